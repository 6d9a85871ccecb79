#include "ros/builder/scan_fuser.h"

#include <chrono>
#include <exception>
#include <stdexcept>
#include <utility>

#include "ros/messages/cloud_conversion.h"
#include "ttsdf_localization/frames/pinhole.h"

namespace ttsdf {

const OptionTable<ScanFuserOptions>& scanFuserOptionTable() {
  using Options = ScanFuserOptions;
  static const OptionTable<Options> table =
      OptionTable<Options>()
          .add("queue_size", &Options::queue_size, 1, 100000, "",
               "Clouds that wait for fusion; when more come, the oldest is dropped and counted.")
          .add("max_volume_megabytes", &Options::max_volume_megabytes, 1.0, 1e6, "MB",
               "Fusion refuses clouds once the volume takes this much memory.");
  return table;
}

ScanFuser::ScanFuser(const FusionOptions& fusion, const ScanFuserOptions& options,
                     std::optional<TsdfVolume> before)
    : fusion_(fusion),
      options_(options),
      volume_(before ? std::move(*before) : TsdfVolume(fusion)),
      comparison_(fusion) {
  scanFuserOptionTable().validate(options);
  counts_.volume_bytes = volume_.memoryBytes();
  thread_ = std::thread(&ScanFuser::run, this);
}

ScanFuser::~ScanFuser() {
  {
    const std::lock_guard<std::mutex> lock(queue_mutex_);
    stop_ = true;
  }
  arrived_.notify_all();
  handled_.notify_all();
  thread_.join();
}

void ScanFuser::push(const sensor_msgs::PointCloud2ConstPtr& cloud, const Eigen::Isometry3d& T_map_sensor) {
  {
    const std::lock_guard<std::mutex> lock(queue_mutex_);
    if (queue_.size() >= static_cast<std::size_t>(options_.queue_size)) {
      queue_.pop_front();
      ++counts_.dropped;
      ++done_;
    }
    queue_.push_back({cloud, T_map_sensor});
    ++queued_;
  }
  arrived_.notify_one();
}

bool ScanFuser::flush(const std::function<bool()>& cancelled) {
  std::unique_lock<std::mutex> lock(queue_mutex_);
  const std::uint64_t target = queued_;
  while (done_ < target) {
    if (stop_ || (cancelled && cancelled())) return false;
    handled_.wait_for(lock, std::chrono::milliseconds(100));
  }
  return true;
}

void ScanFuser::withVolume(const std::function<void(const TsdfVolume&)>& use) {
  const std::lock_guard<std::mutex> lock(volume_mutex_);
  use(volume_);
}

FrameAgreement ScanFuser::agreement() {
  const std::lock_guard<std::mutex> lock(volume_mutex_);
  return summarize(comparison_.compare(), fusion_.voxel_size);
}

void ScanFuser::reset() {
  const std::lock_guard<std::mutex> volume_lock(volume_mutex_);
  volume_ = TsdfVolume(fusion_);
  comparison_ = FrameComparison(fusion_);
  const std::lock_guard<std::mutex> lock(queue_mutex_);
  done_ += queue_.size();
  queue_.clear();
  counts_ = {};
  handled_.notify_all();
}

ScanFuser::Counts ScanFuser::counts() const {
  const std::lock_guard<std::mutex> lock(queue_mutex_);
  Counts counts = counts_;
  counts.waiting = static_cast<std::uint32_t>(queue_.size());
  return counts;
}

void ScanFuser::run() {
  for (;;) {
    {
      std::unique_lock<std::mutex> lock(queue_mutex_);
      arrived_.wait(lock, [this] { return stop_ || !queue_.empty(); });
      if (stop_) return;
    }
    {
      const std::lock_guard<std::mutex> volume_lock(volume_mutex_);
      Scan scan;
      {
        // Taken only now: a reset or a newer cloud may have emptied the queue while a build held the volume.
        const std::lock_guard<std::mutex> lock(queue_mutex_);
        if (stop_) return;
        if (queue_.empty()) continue;
        scan = std::move(queue_.front());
        queue_.pop_front();
      }
      fuse(scan);
    }
  }
}

void ScanFuser::fuse(const Scan& scan) {
  std::string error;
  try {
    const double megabytes = static_cast<double>(counts().volume_bytes) * 1e-6;
    if (megabytes > options_.max_volume_megabytes) {
      throw std::runtime_error("the fused volume takes " + std::to_string(static_cast<int>(megabytes)) +
                               " MB, wanted at most max_volume_megabytes " +
                               std::to_string(static_cast<int>(options_.max_volume_megabytes)));
    }
    const Eigen::Matrix3Xf points = allPoints(*scan.cloud);
    if (!points.array().isFinite().any())
      throw std::invalid_argument("cloud: got no finite point, wanted some");
    const auto pinhole =
        pinholeFromCloud(points, static_cast<int>(scan.cloud->width), static_cast<int>(scan.cloud->height));
    if (pinhole) {
      volume_.integrate(pinhole->first, pinhole->second, scan.T_map_sensor);
      comparison_.add(pinhole->first, pinhole->second, scan.T_map_sensor);
    } else {
      volume_.integrate(points, scan.T_map_sensor);
      comparison_.add(points, scan.T_map_sensor);
    }
  } catch (const std::exception& e) {
    error = e.what();
  }
  const std::lock_guard<std::mutex> lock(queue_mutex_);
  if (error.empty()) {
    ++counts_.fused;
  } else {
    ++counts_.rejected;
    counts_.last_error = error;
  }
  counts_.volume_bytes = volume_.memoryBytes();
  ++done_;
  handled_.notify_all();
}

}  // namespace ttsdf

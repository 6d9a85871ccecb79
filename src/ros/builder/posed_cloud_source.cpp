#include "ros/builder/posed_cloud_source.h"

#include <exception>
#include <utility>

#include "ros/messages/conversions.h"
#include "ros/scans/transform_buffer.h"

namespace ttsdf {

namespace {
constexpr double kLook = 0.05;  // [s] between two looks at the queue without news

ScanQueue::Options queueOptions(const std::string& global_frame_id, int queue_size) {
  ScanQueue::Options options;
  options.targets = {global_frame_id};
  options.size = static_cast<std::size_t>(queue_size);
  return options;
}
}  // namespace

PosedCloudSource::PosedCloudSource(ros::NodeHandle nh, const std::string& global_frame_id,
                                   const ScanSelectionOptions& selection, int queue_size, Callback callback)
    : global_frame_id_(withoutLeadingSlash(global_frame_id)),
      callback_(std::move(callback)),
      queue_(queueOptions(global_frame_id_, queue_size), buffer_),
      selector_(selection) {
  transforms_ = std::make_unique<TransformInput>(nh, [this](const tf2_msgs::TFMessage& message,
                                                            const std::string& authority, bool is_static) {
    for (const auto& transform : message.transforms) {
      const AddedTransform added = addTransform(buffer_, transform, authority, is_static, ros::Time::now());
      if (!added.left_out.empty())
        ROS_WARN_STREAM_THROTTLE(5.0, "left out: " << added.left_out << " (from " << authority << ")");
    }
    if (!queue_.empty()) processQueue();
  });
  subscriber_ =
      nh.subscribe("cloud", static_cast<std::uint32_t>(queue_size), &PosedCloudSource::onCloud, this);
  timer_ =
      nh.createWallTimer(ros::WallDuration(kLook), [this](const ros::WallTimerEvent&) { processQueue(); });
}

PosedCloudSource::~PosedCloudSource() {
  timer_.stop();
  subscriber_.shutdown();
  transforms_->shutdown();
}

void PosedCloudSource::onCloud(const sensor_msgs::PointCloud2ConstPtr& cloud) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.received;
    counts_.last_received = ros::WallTime::now();
    counts_.sensor_frame_id = withoutLeadingSlash(cloud->header.frame_id);
  }
  // tf2 takes stamp 0 for "the newest transform", which is the pose of another moment.
  if (cloud->header.stamp.isZero()) return reject(cloud->header.frame_id, "the cloud has stamp 0");
  if (cloud->header.frame_id.empty()) return reject("", "the cloud has an empty frame_id");
  bool jumped_back = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    jumped_back = stamps_.stampsJumpedBack(cloud->header.stamp);
    if (jumped_back) selector_.reset();
  }
  if (jumped_back) {
    // Transforms and waiting clouds of the time that was undone would be mixed up with those that come now.
    ROS_WARN_STREAM("Stamps went back to " << cloud->header.stamp
                                           << ": transforms and waiting clouds are forgotten, "
                                              "fused scans are kept");
    buffer_.clear();
    queue_.clear();
  }
  QueuedScan scan;
  scan.header = cloud->header;
  scan.header.frame_id = withoutLeadingSlash(cloud->header.frame_id);
  scan.cloud = cloud;
  queue_.put(std::move(scan), ros::Time::now());
  processQueue();
}

void PosedCloudSource::processQueue() {
  while (const std::optional<ScanQueue::Taken> taken = queue_.take(ros::Time::now())) {
    // Overtaken clouds were complete: all are fused, one after the other.
    if (taken->missing.empty()) {
      handle(taken->scan);
    } else {
      reject(taken->scan.header.frame_id, taken->missing);
    }
  }
}

void PosedCloudSource::handle(const QueuedScan& scan) {
  Eigen::Isometry3d T_map_sensor;
  try {
    T_map_sensor = fromMessage(
        buffer_.lookupTransform(global_frame_id_, scan.header.frame_id, scan.header.stamp).transform);
  } catch (const std::exception& error) {  // forgotten meanwhile, or one that is no rigid motion
    return reject(scan.header.frame_id, error.what());
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    counts_.last_transform_error.clear();
    counts_.last_transformed = ros::WallTime::now();
    if (!selector_.take(scan.header.stamp.toSec(), T_map_sensor)) {
      ++counts_.skipped;
      return;
    }
  }
  callback_(scan.cloud, T_map_sensor);
}

void PosedCloudSource::reject(const std::string& frame_id, const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.without_transform;
  counts_.last_transform_error = "no transform from '" + frame_id + "' to '" + global_frame_id_ + "': " + why;
}

PosedCloudSource::Counts PosedCloudSource::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counts_;
}

void PosedCloudSource::reset() {
  buffer_.clear();
  queue_.clear();
  const std::lock_guard<std::mutex> lock(mutex_);
  stamps_ = ClockWatch();  // the same bag again is no jump
  selector_.reset();
  counts_ = {};
}

}  // namespace ttsdf

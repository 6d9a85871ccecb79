#pragma once
// Fuses posed clouds into a TsdfVolume in a thread of its own, so that clouds can come in while fusion or a
// build is busy.

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Geometry>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "ttsdf_localization/agreement/frame_comparison.h"
#include "ttsdf_localization/fusion/tsdf_volume.h"

namespace ttsdf {

struct ScanFuserOptions {
  int queue_size = 30;                   ///< clouds that wait for fusion; more: the oldest is dropped
  double max_volume_megabytes = 4000.0;  ///< fusion refuses clouds above this
};
const OptionTable<ScanFuserOptions>& scanFuserOptionTable();

/// Thread-safe.
class ScanFuser {
 public:
  struct Counts {
    std::uint32_t waiting = 0, dropped = 0, rejected = 0, fused = 0;
    std::size_t volume_bytes = 0;
    std::string last_error;  ///< why the last cloud was rejected
  };

  /// Starts the fusion thread with what was fused before, if anything. Throws std::invalid_argument for bad
  /// options.
  ScanFuser(const FusionOptions& fusion, const ScanFuserOptions& options,
            std::optional<TsdfVolume> before = {});
  /// Ends the thread after the cloud in work; what waits is not fused.
  ~ScanFuser();
  ScanFuser(const ScanFuser&) = delete;
  ScanFuser& operator=(const ScanFuser&) = delete;

  /// Queues a cloud. `T_map_sensor` belongs to the cloud's own frame.
  void push(const sensor_msgs::PointCloud2ConstPtr& cloud, const Eigen::Isometry3d& T_map_sensor);
  /// Waits until every cloud queued before the call was handled. `cancelled` is asked now and then; true:
  /// gives up. Returns false if it gave up.
  bool flush(const std::function<bool()>& cancelled);
  /// Gives the volume to `use` while fusion pauses; clouds queue up meanwhile.
  void withVolume(const std::function<void(const TsdfVolume&)>& use);
  /// How far the clouds fused so far agree with each other. Fusion pauses meanwhile.
  FrameAgreement agreement();
  /// An empty volume, an empty queue, counts of 0. Waits for the cloud in work and for withVolume.
  void reset();
  Counts counts() const;

 private:
  struct Scan {
    sensor_msgs::PointCloud2ConstPtr cloud;
    Eigen::Isometry3d T_map_sensor;
  };

  void run();
  void fuse(const Scan& scan);

  const FusionOptions fusion_;
  const ScanFuserOptions options_;

  std::mutex volume_mutex_;  ///< of volume_ and comparison_; taken before queue_mutex_ where both are needed
  TsdfVolume volume_;
  FrameComparison comparison_;

  mutable std::mutex queue_mutex_;
  std::condition_variable arrived_, handled_;
  std::deque<Scan> queue_;
  Counts counts_;
  std::uint64_t queued_ = 0,
                done_ = 0;  ///< clouds ever pushed; fused, rejected, dropped or thrown away by reset
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace ttsdf

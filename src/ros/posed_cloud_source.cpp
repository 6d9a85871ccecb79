#include "ttsdf_localization/ros/posed_cloud_source.h"

#include <tf2/exceptions.h>
#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <utility>

#include "ttsdf_localization/ros/conversions.h"

namespace ttsdf {

namespace {

/// A step back of the stamps by more than this is a clock that was set back, not a late message [s].
constexpr double kClockStep = 1.0;

}  // namespace

PosedCloudSource::PosedCloudSource(ros::NodeHandle nh, const std::string& global_frame_id,
                                   const ScanSelectionOptions& selection, int queue_size, Callback callback)
    : global_frame_id_(withoutLeadingSlash(global_frame_id)),
      callback_(std::move(callback)),
      // In the clouds' queue, not in a thread of its own: tf2's filter forgets a cloud whose transform comes
      // while the cloud is being added.
      listener_(std::make_unique<tf2_ros::TransformListener>(buffer_, nh, false)),
      selector_(selection),
      filter_(buffer_, global_frame_id_, static_cast<std::uint32_t>(queue_size), nh) {
  filter_.registerCallback([this](const sensor_msgs::PointCloud2ConstPtr& cloud) { handle(cloud); });
  filter_.registerFailureCallback([this](const sensor_msgs::PointCloud2ConstPtr& cloud,
                                         tf2_ros::filter_failure_reasons::FilterFailureReason reason) {
    using namespace tf2_ros::filter_failure_reasons;
    handleFailure(cloud, reason == EmptyFrameID ? "the cloud has an empty frame_id"
                         : reason == OutTheBack ? "the cloud is older than all transforms"
                                                : "no transform came while the cloud waited");
  });
  // First the watch, then the filter: a clock that was set back empties the filter before the cloud gets
  // there.
  subscriber_.registerCallback(&PosedCloudSource::watch, this);
  filter_.connectInput(subscriber_);
  subscriber_.subscribe(nh, "cloud", static_cast<std::uint32_t>(queue_size));
}

PosedCloudSource::~PosedCloudSource() {
  subscriber_.unsubscribe();
  listener_.reset();  // no transform must walk through the filter's requests while they are taken away
}

void PosedCloudSource::watch(const sensor_msgs::PointCloud2ConstPtr& cloud) {
  bool clock_set_back = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.received;
    counts_.last_received = ros::WallTime::now();
    counts_.sensor_frame_id = withoutLeadingSlash(cloud->header.frame_id);
    const double stamp = cloud->header.stamp.toSec();
    // Stamp 0 means that there is none; it is refused later.
    clock_set_back = stamp > 0.0 && stamp + kClockStep < newest_stamp_;
    newest_stamp_ = clock_set_back ? stamp : std::max(newest_stamp_, stamp);
    if (clock_set_back) selector_.reset();
  }
  if (clock_set_back) {
    // Transforms and waiting clouds of the time that was undone would be mixed up with those that come now.
    ROS_WARN_STREAM("Stamps went back to " << cloud->header.stamp
                                           << ": transforms and waiting clouds are forgotten, "
                                              "fused scans are kept");
    buffer_.clear();
    filter_.clear();
  }
}

void PosedCloudSource::handle(const sensor_msgs::PointCloud2ConstPtr& cloud) {
  // tf2 takes stamp 0 for "the newest transform", which is the pose of another moment.
  if (cloud->header.stamp.isZero()) return handleFailure(cloud, "the cloud has stamp 0");
  Eigen::Isometry3d T_map_sensor;
  try {
    T_map_sensor = tf2::transformToEigen(buffer_.lookupTransform(
        global_frame_id_, withoutLeadingSlash(cloud->header.frame_id), cloud->header.stamp));
  } catch (const tf2::TransformException& error) {
    return handleFailure(cloud, error.what());
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    counts_.last_transform_error.clear();
    counts_.last_transformed = ros::WallTime::now();
    if (!selector_.take(cloud->header.stamp.toSec(), T_map_sensor)) {
      ++counts_.skipped;
      return;
    }
  }
  callback_(cloud, T_map_sensor);
}

void PosedCloudSource::handleFailure(const sensor_msgs::PointCloud2ConstPtr& cloud, const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.without_transform;
  counts_.last_transform_error =
      "no transform from '" + cloud->header.frame_id + "' to '" + global_frame_id_ + "': " + why;
}

PosedCloudSource::Counts PosedCloudSource::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counts_;
}

void PosedCloudSource::reset() {
  buffer_.clear();
  filter_.clear();
  const std::lock_guard<std::mutex> lock(mutex_);
  selector_.reset();
  counts_ = {};
  newest_stamp_ = 0.0;
}

}  // namespace ttsdf

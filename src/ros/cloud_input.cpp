#include "ttsdf_localization/ros/cloud_input.h"

#include <ros/names.h>
#include <tf2_ros/message_filter.h>

#include <algorithm>
#include <boost/bind/bind.hpp>
#include <boost/make_shared.hpp>
#include <exception>
#include <sstream>
#include <utility>

#include "ttsdf_localization/LocalizationStatus.h"
#include "ttsdf_localization/ros/conversions.h"

namespace ttsdf {

namespace {
using Status = ttsdf_localization::LocalizationStatus;
/// A stamp further ahead of the clock is a wrong clock, not a camera that is a little early.
constexpr double kMaxFuture = 1.0;  // [s]

std::vector<std::string> neededFrames(const FrameOptions& frames, const std::string& prior) {
  std::vector<std::string> needed{frames.base_frame_id};
  if (!frames.odom_frame_id.empty()) needed.push_back(frames.odom_frame_id);
  if (prior == "external") needed.push_back(frames.global_frame_id);
  return needed;
}

Eigen::Isometry3d lookUp(const tf2::BufferCore& buffer, const std::string& target, const std::string& source,
                         const ros::Time& stamp) {
  return fromMessage(buffer.lookupTransform(target, source, stamp).transform);
}
}  // namespace

class CloudInput::Filter : public tf2_ros::MessageFilter<CloudScan> {
 public:
  using tf2_ros::MessageFilter<CloudScan>::MessageFilter;
};

CloudInput::CloudInput(ros::NodeHandle& node, tf2_ros::Buffer& buffer, const FrameOptions& frames,
                       const CloudOptions& cloud, const std::string& prior, Callbacks callbacks)
    : frames_(frames),
      callbacks_(std::move(callbacks)),
      buffer_(buffer),
      target_frames_(neededFrames(frames, prior)),
      uses_odometry_(!frames.odom_frame_id.empty()),
      cloud_options_(cloud) {
  filter_ = std::make_unique<Filter>(buffer, "", static_cast<std::uint32_t>(frames.tf_queue_size), node);
  filter_->setTargetFrames(target_frames_);
  filter_->registerCallback(boost::function<void(const boost::shared_ptr<const CloudScan>&)>(
      [this](const boost::shared_ptr<const CloudScan>& scan) {
        if (!wasRescued(scan)) onReady(scan);
      }));
  filter_->registerFailureCallback(
      [this](const boost::shared_ptr<const CloudScan>& scan, tf2_ros::FilterFailureReason reason) {
        if (wasRescued(scan)) return;
        onDropped(scan, reason == tf2_ros::filter_failure_reasons::OutTheBack
                            ? "the cloud is older than the transforms kept"
                            : "its transforms did not come in time");
      });
  subscriber_ = node.subscribe<sensor_msgs::PointCloud2>(
      "cloud", 1, [this](const sensor_msgs::PointCloud2ConstPtr& message) { onCloud(message); },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
}

CloudInput::~CloudInput() {
  subscriber_.shutdown();
  filter_->clear();
}

void CloudInput::clear() {
  filter_->clear();
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ready_stamp_ = last_bridged_stamp_ = ros::Time();
  waiting_.reset();
  rescued_.clear();
}

void CloudInput::setCloudOptions(const CloudOptions& options) {
  const std::lock_guard<std::mutex> lock(mutex_);
  cloud_options_ = options;
}

CloudCounts CloudInput::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counts_;
}

std::string CloudInput::topic() const { return subscriber_.getTopic(); }

std::string CloudInput::checkHeader(const std_msgs::Header& header) const {
  if (header.frame_id.empty()) return "the cloud has no frame_id";
  if (header.stamp.isZero()) return "the cloud has stamp 0: no transform can be looked up for it";
  if (ros::Time::now().isZero())
    return "the clock stands at 0: /use_sim_time is true and nobody publishes /clock (rosparam delete "
           "/use_sim_time, if it is left from a replay)";
  const double ahead = (header.stamp - ros::Time::now()).toSec();
  if (ahead > kMaxFuture) {
    std::ostringstream text;
    text << "the cloud's stamp lies " << ahead << " s in the future, at most " << kMaxFuture << " s allowed";
    return text.str();
  }
  return {};
}

void CloudInput::onCloud(const sensor_msgs::PointCloud2ConstPtr& cloud) {
  CloudOptions options;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    options = cloud_options_;
    ++counts_.received;
    counts_.last_arrival = ros::WallTime::now();
  }
  if (!callbacks_.arrived(cloud->header)) return;
  auto scan = boost::make_shared<CloudScan>();
  scan->header = cloud->header;
  scan->header.frame_id = withoutLeadingSlash(cloud->header.frame_id);
  std::string problem = checkHeader(scan->header);
  try {
    if (problem.empty()) scan->points = convertCloud(*cloud, options).points;
  } catch (const std::exception& error) {
    problem = error.what();
  }
  if (!problem.empty()) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++counts_.unreadable;
    }
    callbacks_.refused(cloud->header, Status::REASON_BAD_CLOUD, problem);
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    waiting_ = scan->header;
  }
  if (hasTransforms(*scan)) {
    onReady(scan);
    return;
  }
  filter_->add(boost::shared_ptr<const CloudScan>(scan));
  // tf2's filter forgets a message whose transform comes while it is being added.
  if (hasTransforms(*scan)) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (scan->header.stamp <= last_ready_stamp_) return;
      rescued_.insert(scan);
    }
    onReady(scan);
    return;
  }
  goOnWithoutOdometry(scan);
}

bool CloudInput::hasTransforms(const CloudScan& scan) const {
  return std::all_of(target_frames_.begin(), target_frames_.end(), [&](const std::string& target) {
    return buffer_.canTransform(target, scan.header.frame_id, scan.header.stamp);
  });
}

bool CloudInput::wasRescued(const boost::shared_ptr<const CloudScan>& scan) {
  const std::lock_guard<std::mutex> lock(mutex_);
  return rescued_.erase(scan) > 0;
}

void CloudInput::onReady(const boost::shared_ptr<const CloudScan>& scan) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    counts_.last_ready = ros::WallTime::now();
    if (scan->header.stamp > last_ready_stamp_) last_ready_stamp_ = scan->header.stamp;
    noLongerWaiting(scan->header);
  }
  callbacks_.ready(scan, true);
}

void CloudInput::onDropped(const boost::shared_ptr<const CloudScan>& scan, const std::string& why) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.untransformed;
    // While scans go on without odometry, the copies that wait for it are dropped and nobody misses them.
    if (scan->header.stamp <= last_bridged_stamp_) return;
  }
  callbacks_.refused(scan->header, Status::REASON_NO_TRANSFORM, why + whyWaiting());
  const std::lock_guard<std::mutex> lock(mutex_);
  noLongerWaiting(scan->header);
}

void CloudInput::noLongerWaiting(const std_msgs::Header& header) {
  if (waiting_ && header.stamp >= waiting_->stamp) waiting_.reset();
}

void CloudInput::goOnWithoutOdometry(const boost::shared_ptr<const CloudScan>& scan) {
  if (!uses_odometry_ || frames_.odometry_timeout <= 0.0) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    // Only a drop-out is bridged: odometry that never was there is a mistake in the set-up.
    if (last_ready_stamp_.isZero() ||
        (scan->header.stamp - last_ready_stamp_).toSec() < frames_.odometry_timeout) {
      return;
    }
  }
  if (buffer_.canTransform(frames_.odom_frame_id, scan->header.frame_id, scan->header.stamp)) return;
  if (!buffer_.canTransform(frames_.base_frame_id, scan->header.frame_id, scan->header.stamp)) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    counts_.last_ready = ros::WallTime::now();
    last_bridged_stamp_ = scan->header.stamp;
    noLongerWaiting(scan->header);
  }
  callbacks_.ready(scan, false);
}

std::string CloudInput::whyWaiting() const {
  std::optional<std_msgs::Header> cloud;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    cloud = waiting_;
  }
  if (!cloud) return {};
  for (const std::string& target : target_frames_) {
    std::string why;
    if (!buffer_.canTransform(target, cloud->frame_id, cloud->stamp, &why)) {
      return "; no transform '" + cloud->frame_id + "' -> '" + target + "' at the cloud's stamp: " + why;
    }
  }
  return {};
}

LocalizerScan withTransforms(const CloudScan& scan, bool odometry, const tf2::BufferCore& buffer,
                             const FrameOptions& frames, const std::string& prior) {
  LocalizerScan result;
  const ros::Time stamp = scan.header.stamp;
  result.stamp = stamp.toSec();
  result.points = scan.points;
  result.T_base_sensor = lookUp(buffer, frames.base_frame_id, scan.header.frame_id, stamp);
  if (odometry && !frames.odom_frame_id.empty()) {
    result.T_odom_base = lookUp(buffer, frames.odom_frame_id, frames.base_frame_id, stamp);
  }
  if (prior == "external") {
    result.T_map_base_prior = lookUp(buffer, frames.global_frame_id, frames.base_frame_id, stamp);
  }
  return result;
}

}  // namespace ttsdf

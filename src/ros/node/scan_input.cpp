#include "ros/node/scan_input.h"

#include <ros/subscriber.h>

#include <boost/make_shared.hpp>
#include <exception>
#include <iomanip>
#include <sstream>
#include <utility>

#include "ros/messages/conversions.h"
#include "ros/messages/depth_conversion.h"
#include "ros/messages/stamps.h"

namespace ttsdf {

namespace {
/// A stamp further ahead of the clock is a wrong clock, not a camera that is a little early.
constexpr double kMaxFuture = 1.0;  // [s]
/// Reading a message takes milliseconds and never waits for the registration: more than these are never
/// there.
constexpr std::uint32_t kSubscriberQueue = 10;

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::string infoBeside(const std::string& image) {
  std::string folder = image;
  if (endsWith(folder, "/compressedDepth")) folder.resize(folder.rfind('/'));
  const std::size_t slash = folder.rfind('/');
  return slash == std::string::npos ? "camera_info" : folder.substr(0, slash) + "/camera_info";
}
}  // namespace

struct ScanInput::Topic {
  ros::Subscriber scans, info_subscriber;
  ClockWatch stamps;
  sensor_msgs::CameraInfoConstPtr info;
  sensor_msgs::ImageConstPtr waiting;  ///< for its camera_info
  bool warned = false;
};

std::string headerProblem(const std_msgs::Header& header) {
  if (header.frame_id.empty()) return "the scan has no frame_id";
  if (header.stamp.isZero()) return "the scan has stamp 0: no transform can be looked up for it";
  const ros::Time now = ros::Time::now();
  if (now.isZero()) {
    return "the clock stands at 0: /use_sim_time is true and nobody publishes /clock (rosparam delete "
           "/use_sim_time, if it is left from a replay)";
  }
  const double ahead = secondsBetween(now, header.stamp);
  if (ahead <= kMaxFuture) return {};
  std::ostringstream text;
  text << "the scan's stamp lies " << std::fixed << std::setprecision(1) << ahead << " s in the future ("
       << header.stamp << "), at most " << kMaxFuture << " s allowed";
  return text.str();
}

ScanInput::ScanInput(ros::NodeHandle& node, const InputOptions& input, const CloudOptions& cloud,
                     Callbacks callbacks)
    : callbacks_(std::move(callbacks)), options_(cloud) {
  for (const std::string& name : words(input.clouds)) subscribeCloud(node, name);
  for (const std::string& name : words(input.depth_images)) subscribeDepth(node, name);
}

ScanInput::~ScanInput() {
  for (const auto& topic : topics_) {
    topic->scans.shutdown();
    topic->info_subscriber.shutdown();
  }
}

void ScanInput::setCloudOptions(const CloudOptions& options) {
  const std::lock_guard<std::mutex> lock(mutex_);
  options_ = options;
}

std::string ScanInput::topic() const { return topics_.front()->scans.getTopic(); }

void ScanInput::subscribeCloud(ros::NodeHandle& node, const std::string& name) {
  topics_.push_back(std::make_unique<Topic>());
  Topic& topic = *topics_.back();
  topic.scans = node.subscribe<sensor_msgs::PointCloud2>(
      name, kSubscriberQueue,
      [this, &topic](const sensor_msgs::PointCloud2ConstPtr& cloud) {
        take(topic, cloud->header,
             [&](const CloudOptions& options) { return convertCloud(*cloud, options); });
      },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
}

void ScanInput::subscribeDepth(ros::NodeHandle& node, const std::string& name) {
  topics_.push_back(std::make_unique<Topic>());
  Topic& topic = *topics_.back();
  topic.info_subscriber = node.subscribe<sensor_msgs::CameraInfo>(
      infoBeside(name), kSubscriberQueue,
      [this, &topic](const sensor_msgs::CameraInfoConstPtr& info) { onInfo(topic, info); });
  const auto hints = ros::TransportHints().tcpNoDelay();
  if (!endsWith(name, "compressedDepth")) {
    topic.scans = node.subscribe<sensor_msgs::Image>(
        name, kSubscriberQueue,
        [this, &topic](const sensor_msgs::ImageConstPtr& image) { onImage(topic, image); },
        ros::VoidConstPtr(), hints);
    return;
  }
  topic.scans = node.subscribe<sensor_msgs::CompressedImage>(
      name, kSubscriberQueue,
      [this, &topic](const sensor_msgs::CompressedImageConstPtr& compressed) {
        sensor_msgs::ImageConstPtr image;
        try {
          image = boost::make_shared<sensor_msgs::Image>(decompressDepth(*compressed));
        } catch (const std::exception& error) {
          if (callbacks_.arrived()) callbacks_.rejected(compressed->header, error.what());
          return;
        }
        onImage(topic, image);
      },
      ros::VoidConstPtr(), hints);
}

void ScanInput::onInfo(Topic& topic, const sensor_msgs::CameraInfoConstPtr& info) {
  topic.info = info;
  if (topic.waiting) onImage(topic, std::exchange(topic.waiting, nullptr));
}

void ScanInput::onImage(Topic& topic, const sensor_msgs::ImageConstPtr& image) {
  if (!topic.info) {  // its camera_info may come next
    if (topic.waiting && callbacks_.arrived())
      callbacks_.rejected(topic.waiting->header,
                          "no camera_info on '" + topic.info_subscriber.getTopic() + "'");
    topic.waiting = image;
    return;
  }
  take(topic, image->header,
       [&](const CloudOptions& options) { return convertDepth(*image, *topic.info, options); });
}

void ScanInput::take(Topic& topic, const std_msgs::Header& header,
                     const std::function<ConvertedCloud(const CloudOptions&)>& convert) {
  // Without simulated time a looping bag shows in the stamps only; a stamp ahead of the clock is rejected
  // below. A jump of the clock is noticed elsewhere, and must not be noticed again here.
  const ros::Time now = ros::Time::now();
  topic.stamps.clockJumpedBack(now);
  if (header.stamp <= now && topic.stamps.stampsJumpedBack(header.stamp))
    callbacks_.time_jumped_back("the stamps of '" + topic.scans.getTopic() + "' went back");
  if (!callbacks_.arrived()) return;
  CloudOptions options;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    options = options_;
  }
  QueuedScan scan;
  scan.header = header;
  scan.header.frame_id = withoutLeadingSlash(header.frame_id);
  std::string problem;
  try {
    problem = headerProblem(scan.header);
    if (problem.empty()) {
      ConvertedCloud converted = convert(options);
      scan.points = std::move(converted.points);
      if (converted.wrong_byte_order && !std::exchange(topic.warned, true)) {
        ROS_WARN_STREAM("'" << topic.scans.getTopic()
                            << "': is_bigendian of the clouds is wrong, they are read the other way round");
      }
    }
  } catch (const std::exception& error) {
    problem = error.what();
  }
  if (problem.empty()) {
    callbacks_.ready(std::move(scan));
  } else {
    callbacks_.rejected(header, problem);
  }
}

}  // namespace ttsdf

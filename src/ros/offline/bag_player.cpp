// Messages of a bag, in its order, into the localizer.

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <map>
#include <stdexcept>

#include "ros/messages/conversions.h"
#include "ros/messages/depth_conversion.h"
#include "ros/offline/offline_run.h"

namespace ttsdf {

namespace {

std::map<std::string, std::string> typesByTopic(const rosbag::Bag& bag) {
  std::map<std::string, std::string> types;
  for (const rosbag::ConnectionInfo* connection : rosbag::View(bag).getConnections()) {
    types[withoutLeadingSlash(connection->topic)] = connection->datatype;
  }
  return types;
}

std::string listed(const std::map<std::string, std::string>& types) {
  std::string text;
  for (const auto& [topic, type] : types) text += (text.empty() ? "" : ", ") + topic + " (" + type + ")";
  return text.empty() ? "no topics" : text;
}

std::vector<std::string> topicsOf(const std::map<std::string, std::string>& types, const std::string& type) {
  std::vector<std::string> topics;
  for (const auto& [topic, its_type] : types) {
    if (its_type == type) topics.push_back(topic);
  }
  return topics;
}

/// The camera_info beside an image topic; a compressed one lies one level below its image.
std::string infoBeside(std::string image) {
  const std::string compressed = "/compressedDepth";
  if (image.size() > compressed.size() &&
      image.compare(image.size() - compressed.size(), compressed.size(), compressed) == 0) {
    image.resize(image.size() - compressed.size());
  }
  const std::size_t slash = image.rfind('/');
  return slash == std::string::npos ? "camera_info" : image.substr(0, slash) + "/camera_info";
}

/// Errors of `convert` with the topic's name.
template <class Convert>
auto named(const std::string& topic, const Convert& convert) {
  return [&topic, convert](const CloudOptions& options) {
    try {
      return convert(options);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("topic '" + topic + "': " + error.what());
    }
  };
}

class Player {
 public:
  Player(const BagTopics& topics, BagLocalizer& localizer) : topics_(topics), localizer_(localizer) {}

  void add(const rosbag::MessageInstance& message) {
    const std::string topic = withoutLeadingSlash(message.getTopic());
    if (topic == "tf" || topic == "tf_static") {
      if (const auto tf = message.instantiate<tf2_msgs::TFMessage>())
        localizer_.add(*tf, topic == "tf_static");
    } else if (!topics_.cloud.empty() && topic == topics_.cloud) {
      if (const auto cloud = message.instantiate<sensor_msgs::PointCloud2>()) {
        localizer_.add(cloud->header, named(topics_.cloud, [&](const CloudOptions& options) {
                         return convertCloud(*cloud, options);
                       }));
      }
    } else if (topics_.cloud.empty() && topic == topics_.camera_info) {
      addInfo(message.instantiate<sensor_msgs::CameraInfo>());
    } else if (topics_.cloud.empty() && topic == topics_.depth) {
      if (const auto compressed = message.instantiate<sensor_msgs::CompressedImage>()) {
        addCompressed(*compressed);
      } else {
        addImage(message.instantiate<sensor_msgs::Image>());
      }
    } else if (topic == topics_.initial_pose) {
      if (const auto pose = message.instantiate<geometry_msgs::PoseWithCovarianceStamped>())
        localizer_.add(*pose);
    } else if (topic == topics_.imu) {
      if (const auto imu = message.instantiate<sensor_msgs::Imu>()) localizer_.add(*imu);
    }
    localizer_.advance(message.getTime());
  }

 private:
  void addInfo(const sensor_msgs::CameraInfoConstPtr& info) {
    if (!info) return;
    info_ = info;
    if (image_) addScan();
    image_.reset();
  }
  void addImage(const sensor_msgs::ImageConstPtr& image) {
    if (!image) return;
    image_ = image;  // its camera_info may come next
    if (!info_) return;
    addScan();
    image_.reset();
  }
  void addCompressed(const sensor_msgs::CompressedImage& compressed) {
    try {
      addImage(boost::make_shared<sensor_msgs::Image>(decompressDepth(compressed)));
    } catch (const std::exception& error) {
      const std::string why = "topic '" + topics_.depth + "': " + error.what();
      localizer_.add(compressed.header,
                     [&](const CloudOptions&) -> ConvertedCloud { throw std::invalid_argument(why); });
    }
  }
  void addScan() {
    localizer_.add(image_->header, named(topics_.depth, [&](const CloudOptions& options) {
                     return convertDepth(*image_, *info_, options);
                   }));
  }

  const BagTopics topics_;
  BagLocalizer& localizer_;
  sensor_msgs::CameraInfoConstPtr info_;
  sensor_msgs::ImageConstPtr image_;
};

}  // namespace

BagTopics findTopics(const rosbag::Bag& bag, BagTopics wanted) {
  for (std::string* topic :
       {&wanted.cloud, &wanted.depth, &wanted.camera_info, &wanted.initial_pose, &wanted.imu}) {
    *topic = withoutLeadingSlash(*topic);
  }
  const auto types = typesByTopic(bag);
  if (wanted.cloud.empty() && wanted.depth.empty()) {
    const auto clouds = topicsOf(types, "sensor_msgs/PointCloud2");
    std::vector<std::string> images;
    for (const char* type : {"sensor_msgs/Image", "sensor_msgs/CompressedImage"}) {
      if (!images.empty()) break;  // the same images, compressed
      for (const std::string& image : topicsOf(types, type)) {
        const bool depth = type == std::string("sensor_msgs/Image")
                               ? image.find("depth") != std::string::npos
                               : image.find("compressedDepth") != std::string::npos;
        if (depth && types.count(infoBeside(image))) images.push_back(image);
      }
    }
    if (clouds.size() == 1) {
      wanted.cloud = clouds.front();
    } else if (clouds.empty() && images.size() == 1) {
      wanted.depth = images.front();
    } else {
      throw std::runtime_error(
          "bag: wanted one topic of clouds, or one of depth images with its camera_info beside "
          "it, or --cloud or --depth to say which; got " +
          listed(types));
    }
  }
  if (wanted.cloud.empty() && wanted.camera_info.empty()) wanted.camera_info = infoBeside(wanted.depth);
  for (const std::string& topic : {wanted.cloud, wanted.depth, wanted.camera_info}) {
    if (!topic.empty() && !types.count(topic)) {
      throw std::runtime_error("bag: no topic '" + topic + "'; got " + listed(types));
    }
  }
  return wanted;
}

void play(const rosbag::Bag& bag, const BagTopics& topics, BagLocalizer& localizer,
          const std::function<void(double)>& progress) {
  const std::vector<std::string> names = {
      "tf", "tf_static", topics.cloud, topics.depth, topics.camera_info, topics.initial_pose, topics.imu};
  rosbag::View view(bag, [&names](const rosbag::ConnectionInfo* connection) {
    const std::string topic = withoutLeadingSlash(connection->topic);
    return !topic.empty() && std::find(names.begin(), names.end(), topic) != names.end();
  });
  Player player(topics, localizer);
  // Before the first message: a scan that comes before its transforms has waited for no time yet.
  if (view.size() > 0) localizer.advance(view.getBeginTime());
  std::uint32_t done = 0;
  for (const rosbag::MessageInstance& message : view) {
    try {
      player.add(message);
    } catch (const ros::serialization::StreamOverrunException& error) {
      throw std::runtime_error("bag: topic '" + message.getTopic() + "': a message of type " +
                               message.getDataType() + " is damaged or of another type (" + error.what() +
                               ")");
    }
    progress(static_cast<double>(++done) / view.size());
  }
  localizer.processRemaining();
}

}  // namespace ttsdf

#include "ttsdf_localization/ros/depth_to_cloud.h"

#include <depth_image_proc/depth_conversions.h>
#include <sensor_msgs/image_encodings.h>

#include <boost/make_shared.hpp>
#include <stdexcept>

namespace ttsdf {

namespace {

void check(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info,
           std::size_t bytes_per_pixel) {
  if (image.step < image.width * bytes_per_pixel ||
      image.data.size() < std::size_t{image.step} * image.height) {
    throw std::invalid_argument("depth image: got " + std::to_string(image.data.size()) + " bytes, wanted " +
                                std::to_string(image.width) + " x " + std::to_string(image.height) +
                                " pixels");
  }
  if (info.width != image.width || info.height != image.height) {
    throw std::invalid_argument("camera_info: got " + std::to_string(info.width) + " x " +
                                std::to_string(info.height) + ", wanted the size of the depth image, " +
                                std::to_string(image.width) + " x " + std::to_string(image.height));
  }
  if (!(info.P[0] > 0.0 && info.P[5] > 0.0)) {
    throw std::invalid_argument("camera_info: got the focal lengths " + std::to_string(info.P[0]) + " and " +
                                std::to_string(info.P[5]) + " in P, wanted them above 0");
  }
}

}  // namespace

sensor_msgs::PointCloud2::Ptr toCloud(const sensor_msgs::ImageConstPtr& image,
                                      const sensor_msgs::CameraInfo& info) {
  namespace encodings = sensor_msgs::image_encodings;
  const bool millimetres = image->encoding == encodings::TYPE_16UC1 || image->encoding == encodings::MONO16;
  if (!millimetres && image->encoding != encodings::TYPE_32FC1) {
    throw std::invalid_argument("depth image: got encoding '" + image->encoding + "', wanted 16UC1 or 32FC1");
  }
  check(*image, info, millimetres ? 2 : 4);
  auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
  cloud->header = image->header;
  sensor_msgs::PointCloud2Modifier modifier(*cloud);
  modifier.setPointCloud2FieldsByString(1, "xyz");
  modifier.resize(std::size_t{image->width} * image->height);
  cloud->height = image->height;
  cloud->width = image->width;
  cloud->row_step = cloud->width * cloud->point_step;
  cloud->is_dense = 0;
  image_geometry::PinholeCameraModel model;
  model.fromCameraInfo(info);
  if (millimetres) {
    depth_image_proc::convert<std::uint16_t>(image, cloud, model);
  } else {
    depth_image_proc::convert<float>(image, cloud, model);
  }
  return cloud;
}

}  // namespace ttsdf

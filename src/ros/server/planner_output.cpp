#include "ros/server/planner_output.h"

#include <nav_msgs/OccupancyGrid.h>

#include <exception>

#include "ttsdf_localization/exports/occupancy.h"

namespace ttsdf {

PlannerOutput::PlannerOutput(ros::NodeHandle nh, const ros::NodeHandle& options, const TtSdfMap& map)
    : field_(makeField(map)),
      frame_id_(map.frame_id),
      grid_(nh.advertise<nav_msgs::OccupancyGrid>("occupancy_grid", 1, true)),
      service_(nh.advertiseService("query_distances", &PlannerOutput::query, this)) {
  try {
    publishGrid(options, map);
  } catch (const std::exception& error) {
    ROS_WARN_STREAM("No occupancy grid: " << error.what());
  }
}

void PlannerOutput::publishGrid(const ros::NodeHandle& options, const TtSdfMap& map) {
  OccupancyOptions wanted;
  options.getParam("occupancy/resolution", wanted.resolution);
  options.getParam("occupancy/min_height", wanted.min_height);
  options.getParam("occupancy/max_height", wanted.max_height);
  const OccupancyImage image = occupancyOf(map, wanted);
  nav_msgs::OccupancyGrid message;
  message.header.frame_id = frame_id_;
  message.header.stamp = message.info.map_load_time = ros::Time::now();
  message.info.resolution = static_cast<float>(image.resolution);
  message.info.width = static_cast<std::uint32_t>(image.width);
  message.info.height = static_cast<std::uint32_t>(image.height);
  message.info.origin.position.x = image.origin.x();
  message.info.origin.position.y = image.origin.y();
  message.info.origin.orientation.w = 1.0;
  message.data = image.cells;
  grid_.publish(message);
}

bool PlannerOutput::query(ttsdf_localization::QueryDistances::Request& request,
                          ttsdf_localization::QueryDistances::Response& response) {
  Eigen::Matrix3Xf points(3, static_cast<Eigen::Index>(request.points.size()));
  const Eigen::Vector3d& origin = field_->geometry().origin;
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const geometry_msgs::Point& p = request.points[static_cast<std::size_t>(n)];
    points.col(n) = (Eigen::Vector3d(p.x, p.y, p.z) - origin).cast<float>();
  }
  const FieldSamples samples = field_->evaluate(points);
  response.frame_id = frame_id_;
  response.gradients.resize(request.points.size());
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    geometry_msgs::Vector3& gradient = response.gradients[static_cast<std::size_t>(n)];
    gradient.x = static_cast<double>(samples.gradients(0, n));
    gradient.y = static_cast<double>(samples.gradients(1, n));
    gradient.z = static_cast<double>(samples.gradients(2, n));
    response.distances.push_back(samples.values[n]);
    response.valid.push_back(samples.states[static_cast<std::size_t>(n)] == PointState::kValid);
  }
  response.success = true;
  response.message = std::to_string(request.points.size()) + " points";
  return true;
}

}  // namespace ttsdf

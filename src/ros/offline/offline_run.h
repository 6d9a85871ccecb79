#pragma once
// offline_localizer: a bag and a map in; trajectory, statuses and a summary out.

#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <functional>
#include <string>
#include <vector>

#include "ros/offline/bag_localizer.h"

namespace ttsdf {

/// The topics of a bag that a run reads; leading slashes do not matter.
struct BagTopics {
  std::string cloud;               ///< PointCloud2; empty: clouds are made from the depth images
  std::string depth, camera_info;  ///< Image and CameraInfo
  std::string initial_pose = "initialpose";
  std::string imu = "imu";
};

/// Fills in cloud, or depth and camera_info, where they are empty and the bag leaves no choice. Throws
/// std::runtime_error naming what the bag has.
BagTopics findTopics(const rosbag::Bag& bag, BagTopics wanted);

/// Feeds every message of the topics and of /tf and /tf_static. `progress`: share done [0, 1].
void play(const rosbag::Bag& bag, const BagTopics& topics, BagLocalizer& localizer,
          const std::function<void(double)>& progress);

/// The program: parses the command line, runs, prints the summary. Throws UsageError and std::runtime_error.
int runOfflineLocalizer(int argc, char** argv);

}  // namespace ttsdf

#pragma once
// Parameters of the simulated camera node. Groups are sub-namespaces: ~camera/width, ~path/speed,
// ~odometry/..., ~clutter/...

#include <ros/node_handle.h>

#include <string>

#include "ros/parameters/parameters.h"
#include "ttsdf_localization/options/option_table.h"
#include "ttsdf_localization/simulation/simulated_rig.h"

namespace ttsdf {

struct SimulatedCameraOptions {
  double rate = 30.0;            ///< images per second [Hz]
  std::string noise = "kinect";  ///< preset that ~camera's noise options start from: none, kinect, realsense
  std::string depth_encoding = "16UC1";  ///< 16UC1 [mm] or 32FC1 [m]
  std::string global_frame_id = "map";
  std::string odom_frame_id = "odom";
  std::string base_frame_id = "base_link";
  std::string camera_frame_id = "camera_depth_optical_frame";
  bool truth_tf = false;         ///< broadcast the true map -> odom
  double laps = 0.0;             ///< the node ends after this many rounds of the path; 0: never
  double duration = 0.0;         ///< ... or after this time [s]; 0: never
  double kidnap_distance = 5.0;  ///< least distance of a jump [m]
  SimulatedRigOptions rig;
};
/// The fields of SimulatedCameraOptions itself and of `rig` without its groups.
const OptionTable<SimulatedCameraOptions>& simulatedCameraOptionTable();

/// Registers every option under the keys of the YAML file; `options` must outlive the set.
ParameterSet simulatedCameraParameters(SimulatedCameraOptions& options);

/// config/simulated_camera.yaml as it should be: every option with its default and its meaning.
std::string simulatedCameraYaml();

/// Reads and checks every group. Throws std::invalid_argument naming key, value and range.
SimulatedCameraOptions loadSimulatedCameraOptions(const ros::NodeHandle& private_nh);

}  // namespace ttsdf

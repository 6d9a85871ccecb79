#include "ttsdf_localization/ros/simulated_camera_options.h"

#include "ttsdf_localization/ros/conversions.h"
#include "ttsdf_localization/ros/parameters.h"

namespace ttsdf {

const OptionTable<SimulatedCameraOptions>& simulatedCameraOptionTable() {
  using O = SimulatedCameraOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("rate", &O::rate, 0.1, 1000.0, "Hz", "Images per second.")
          .add("noise", &O::noise, {"none", "kinect", "realsense"},
               "Sensor whose noise the options of the group camera start from.")
          .add("depth_encoding", &O::depth_encoding, {"16UC1", "32FC1"},
               "Depth images in millimetres or in metres.")
          .add("global_frame_id", &O::global_frame_id, {}, "Frame of the truth.")
          .add("odom_frame_id", &O::odom_frame_id, {}, "Frame that odometry drifts in.")
          .add("base_frame_id", &O::base_frame_id, {}, "Frame of the body that moves.")
          .add("camera_frame_id", &O::camera_frame_id, {}, "Optical frame of the camera.")
          .add("truth_tf", &O::truth_tf,
               "Broadcast the true transform from the global to the odometry frame.")
          .add("laps", &O::laps, 0.0, 1e6, "", "Rounds of the path after which the node ends; 0: never.")
          .add("duration", &O::duration, 0.0, 1e7, "s", "Time after which the node ends; 0: never.")
          .add("kidnap_distance", &O::kidnap_distance, 0.0, 1000.0, "m", "Least distance of a jump.")
          .add(&O::rig, simulatedRigOptionTable());
  return kTable;
}

SimulatedCameraOptions loadSimulatedCameraOptions(const ros::NodeHandle& private_nh) {
  SimulatedCameraOptions options;
  // The preset comes first: single values of the group camera then change it.
  private_nh.param("noise", options.noise, options.noise);
  options.rig.camera.noise = depthNoise(options.noise);

  ParameterSet parameters;
  parameters.add("", options, simulatedCameraOptionTable());
  parameters.add("mount", options.rig.mount, cameraMountOptionTable());
  parameters.add("camera", options.rig.camera, depthCameraOptionTable());
  parameters.add("path", options.rig.path, trajectoryOptionTable());
  parameters.add("odometry", options.rig.odometry, odometryOptionTable());
  parameters.add("clutter", options.rig.clutter, clutterOptionTable());
  parameters.load(private_nh);
  for (auto* frame :
       {&options.global_frame_id, &options.odom_frame_id, &options.base_frame_id, &options.camera_frame_id}) {
    *frame = withoutLeadingSlash(*frame);
  }
  return options;
}

}  // namespace ttsdf

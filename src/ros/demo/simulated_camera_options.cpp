#include "ros/demo/simulated_camera_options.h"

#include "ros/messages/conversions.h"

namespace ttsdf {

const OptionTable<SimulatedCameraOptions>& simulatedCameraOptionTable() {
  using O = SimulatedCameraOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("rate", &O::rate, 0.1, 1000.0, "Hz", "Images per second.")
          .add("noise", &O::noise, {"none", "kinect", "realsense"},
               "Sensor whose noise the options of the group camera start from.")
          .add("depth_encoding", &O::depth_encoding, {"16UC1", "32FC1"},
               "Depth images in millimetres (0: no reading) or in metres (NaN: no reading).")
          .add("global_frame_id", &O::global_frame_id, {}, "Frame of the truth.")
          .add("odom_frame_id", &O::odom_frame_id, {}, "Frame that odometry drifts in.")
          .add("base_frame_id", &O::base_frame_id, {}, "Frame of the body that moves.")
          .add("camera_frame_id", &O::camera_frame_id, {}, "Optical frame of the camera.")
          .add("truth_tf", &O::truth_tf,
               "Broadcast the true transform from the global to the odometry frame; ~truth_tf switches it.")
          .add("laps", &O::laps, 0.0, 1e6, "", "The node ends after this many rounds of its path; 0: never.")
          .add("duration", &O::duration, 0.0, 1e7, "s", "The node ends after this time; 0: never.")
          .add("kidnap_distance", &O::kidnap_distance, 0.0, 1000.0, "m",
               "Least distance of the jump that ~kidnap makes.")
          .add(&O::rig, simulatedRigOptionTable());
  return kTable;
}

ParameterSet simulatedCameraParameters(SimulatedCameraOptions& options) {
  ParameterSet parameters;
  parameters.add("", options, simulatedCameraOptionTable());
  parameters.add("mount", options.rig.mount, cameraMountOptionTable());
  parameters.add("camera", options.rig.camera, depthCameraOptionTable());
  parameters.add("path", options.rig.path, trajectoryOptionTable());
  parameters.add("odometry", options.rig.odometry, odometryOptionTable());
  parameters.add("clutter", options.rig.clutter, clutterOptionTable());
  return parameters;
}

std::string simulatedCameraYaml() {
  SimulatedCameraOptions defaults;
  defaults.rig.camera.noise = depthNoise(defaults.noise);
  return simulatedCameraParameters(defaults).toYaml(
      "Parameters of simulated_camera_node. Every value here is the default: leave out what you do not "
      "change. An unknown key or a value out of range is refused with a message, and nothing starts.\n"
      "Written from the option tables by the test ros_simulated_camera_options_test with "
      "TTSDF_UPDATE_CONFIG=1; do not edit.",
      {{"mount", "Where the camera sits on the body."},
       {"camera",
        "The image and its noise: values given here change the preset that `noise` names; those "
        "below are kinect's. sigma(z) = noise_base + noise_quadratic z^2."},
       {"path", "How the camera moves; the sway makes every round a little different."},
       {"odometry", "Drift grows with the distance travelled; its direction changes slowly."},
       {"clutter", "People-sized boxes that walk in front of the camera and are in no map."}});
}

SimulatedCameraOptions loadSimulatedCameraOptions(const ros::NodeHandle& private_nh) {
  SimulatedCameraOptions options;
  // The preset comes first: single values of the group camera then change it.
  private_nh.param("noise", options.noise, options.noise);
  options.rig.camera.noise = depthNoise(options.noise);
  simulatedCameraParameters(options).load(private_nh);
  for (auto* frame :
       {&options.global_frame_id, &options.odom_frame_id, &options.base_frame_id, &options.camera_frame_id}) {
    *frame = withoutLeadingSlash(*frame);
  }
  return options;
}

}  // namespace ttsdf

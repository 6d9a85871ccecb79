#include "ros/parameters/localization_options.h"

#include <cmath>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "ros/messages/conversions.h"

namespace ttsdf {

std::vector<std::string> words(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

namespace {
constexpr double kPi = 3.141592653589793;
}

const OptionTable<FrameOptions>& frameOptionTable() {
  using O = FrameOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("global_frame_id", &O::global_frame_id, {}, "Frame of the map.")
          .add("odom_frame_id", &O::odom_frame_id, {},
               "Frame of the odometry. none (or empty): there is none, and global_frame_id -> base_frame_id "
               "is published.")
          .add("base_frame_id", &O::base_frame_id, {}, "Frame whose pose is estimated.")
          .add("tf_broadcast", &O::tf_broadcast,
               "Publish the transform; the pose topics are published anyway.")
          .add("transform_tolerance", &O::transform_tolerance, 0.0, 10.0, "s",
               "map -> odom is stamped this far ahead of the scan. (map -> base carries the scan's stamp.)")
          .add("tf_rate", &O::tf_rate, 1.0, 1000.0, "Hz",
               "The transform is sent again at this rate while tracking.")
          .add("tf_queue_size", &O::tf_queue_size, 1, 1000, "",
               "Reduced scans that wait for their transforms; the oldest is dropped.")
          .add("odometry_timeout", &O::odometry_timeout, 0.0, 60.0, "s",
               "When odometry drops out for longer, scans go on with a constant velocity; 0: they wait.");
  return table;
}

const OptionTable<InputOptions>& inputOptionTable() {
  using O = InputOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("clouds", &O::clouds, {},
               "Topics of clouds, separated by blanks: several cameras of one robot, one pose. Empty: none.")
          .add(
              "depth_images", &O::depth_images, {},
              "Topics of rectified depth images (16UC1, 32FC1, or compressedDepth), separated by blanks; the "
              "camera_info is taken from beside each. No clouds are needed then: set clouds to an empty "
              "text.");
  return table;
}

const OptionTable<UpdateOptions>& updateOptionTable() {
  using O = UpdateOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("max_rate", &O::max_rate, 0.0, 1000.0, "Hz",
               "While tracking, at most so many scans are used; 0: all.")
          .add("update_min_d", &O::update_min_d, 0.0, 100.0, "m",
               "While tracking, a scan is used when the base moved this far since the last one used ... (0 "
               "with "
               "update_min_a 0: always.) Needs odometry; ~request_nomotion_update uses the next one anyway.")
          .add("update_min_a", &O::update_min_a, 0.0, 3.2, "rad", "... or turned this far.");
  return table;
}

const OptionTable<MapSourceOptions>& mapSourceOptionTable() {
  using O = MapSourceOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("map_source", &O::map_source, {"file", "topic", "service", "atlas", "atlas_server"},
               "file (map_file), topic (ttsdf_map), service (get_map), atlas (atlas_folder) or atlas_server "
               "(topic atlas, service get_selected_maps).")
          .add("map_file", &O::map_file, {},
               "Map file to load at the start. Empty: wait for ~load_map or ~set_map.")
          .add("map_folder", &O::map_folder, {},
               "~load_map takes files of this folder only: no way out by '..' or a link. Empty: any file.")
          .add("atlas_folder", &O::atlas_folder, {},
               "Folder with an atlas.yaml: the maps around the robot are loaded as it drives.")
          .add("atlas_megabytes", &O::atlas_megabytes, 1.0, 100000.0, "MB",
               "Memory for all maps of the atlas; each takes at most memory_megabytes.")
          .add("atlas_timeout", &O::atlas_timeout, 0.1, 600.0, "s",
               "A server of an atlas that takes longer to give a map is asked again later.")
          .add("atlas_radius", &O::atlas_radius, 0.5, 1000.0, "m",
               "Maps of the atlas at most this far from the robot are in use.")
          .add("max_map_megabytes", &O::max_map_megabytes, 1.0, 100000.0, "MB",
               "Maps whose reading takes more memory are refused.")
          .add("max_map_voxels", &O::max_map_voxels, 1.0, 1.7e10, "",
               "Maps of larger grids are refused: preparing them takes time with their voxels.")
          .add("memory_megabytes", &O::memory_megabytes, 0.0, 100000.0, "MB",
               "Memory for the map, everything counted: cores, mask, far field, and the parts of the surface "
               "that scans asked for last, decoded. Poses do not depend on it; less than a scan works with "
               "is never taken, and with more, a robot that comes back finds more of the surface decoded.");
  return table;
}

const OptionTable<StartPoseOptions>& startPoseOptionTable() {
  using O = StartPoseOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("set_initial_pose", &O::set_initial_pose,
               "Start at the pose below; otherwise wait for initialpose.")
          .add("initial_pose_x", &O::initial_pose_x, -1e6, 1e6, "m", "Start pose of the base in the map, x.")
          .add("initial_pose_y", &O::initial_pose_y, -1e6, 1e6, "m", "Start pose, y.")
          .add("initial_pose_z", &O::initial_pose_z, -1e6, 1e6, "m", "Start pose, z.")
          .add("initial_pose_roll", &O::initial_pose_roll, -2 * kPi, 2 * kPi, "rad",
               "Start pose, roll (fixed axes: roll, then pitch, then yaw).")
          .add("initial_pose_pitch", &O::initial_pose_pitch, -2 * kPi, 2 * kPi, "rad",
               "Start pose, pitch (fixed axes: roll, then pitch, then yaw).")
          .add("initial_pose_yaw", &O::initial_pose_yaw, -2 * kPi, 2 * kPi, "rad",
               "Start pose, yaw (fixed axes: roll, then pitch, then yaw).")
          .add("pose_file", &O::pose_file, {},
               "The last good pose is kept in this file and is the start pose next time. Empty: not kept.")
          .add("save_pose_period", &O::save_pose_period, 0.1, 86400.0, "s", "How often it is written.");
  return table;
}

const OptionTable<GravityOptions>& gravityOptionTable() {
  using O = GravityOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("gravity_source", &O::gravity_source, {"auto", "none", "frame", "vector", "imu"},
               "Which way is down, for global localization: auto (-z of the odometry frame, none without "
               "odometry), none, "
               "frame (-z of gravity_frame_id), vector (gravity_x, _y, _z in the cloud's frame) or imu "
               "(topic imu, at "
               "rest or moving gently).")
          .add("gravity_frame_id", &O::gravity_frame_id, {},
               "gravity_source frame: a frame whose z axis points up.")
          .add("gravity_x", &O::gravity_x, -10.0, 10.0, "",
               "gravity_source vector: down in the cloud's frame, x.")
          .add("gravity_y", &O::gravity_y, -10.0, 10.0, "", "gravity_source vector: y.")
          .add("gravity_z", &O::gravity_z, -10.0, 10.0, "", "gravity_source vector: z.");
  return table;
}

const OptionTable<OutputOptions>& outputOptionTable() {
  using O = OutputOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("quiet_warning_seconds", &O::quiet_warning_seconds, 0.5, 3600.0, "s",
               "Without scans or without their transforms for this time: a warning that names topic or "
               "frames.")
          .add("path_length", &O::path_length, 2, 1000000, "", "Poses kept in the path.")
          .add("path_spacing", &O::path_spacing, 0.0, 100.0, "m", "Least distance between two of them.");
  return table;
}

ParameterSet localizationParameters(LocalizationRosOptions& options) {
  ParameterSet set;
  set.ignore("diagnostic_period");  // diagnostic_updater's own
  set.add("", options.frames, frameOptionTable());
  set.add("", options.input, inputOptionTable());
  set.add("", options.update, updateOptionTable());
  set.add("", options.map, mapSourceOptionTable());
  set.add("", options.start, startPoseOptionTable());
  set.add("", options.gravity, gravityOptionTable());
  set.add("", options.output, outputOptionTable());
  set.add("", options.localizer, localizerOptionTable());
  set.add("cloud", options.cloud, cloudOptionTable());
  set.add("gates", options.localizer.gates, gateOptionTable());
  set.add("motion", options.localizer.motion, motionOptionTable());
  set.add("recovery", options.localizer.recovery, recoveryOptionTable());
  set.add("registration", options.localizer.registration, registrationOptionTable());
  set.add("search", options.localizer.search, searchOptionTable());
  set.add("global", options.localizer.global, globalOptionTable());
  return set;
}

bool isLive(const std::string& key) {
  if (key == "motion/prior") return false;  // decides which transforms are waited for
  for (const char* live : {"max_rate", "update_min_d", "update_min_a"}) {
    if (key == live) return true;
  }
  if (key == "tf_rate" || key == "transform_tolerance" || key == "quiet_warning_seconds") return true;
  const std::string group = key.substr(0, key.find('/'));
  for (const char* live : {"cloud", "gates", "motion", "recovery", "search", "global"}) {
    if (group == live) return true;
  }
  return false;
}

std::string localizationYaml() {
  LocalizationRosOptions defaults;
  return localizationParameters(defaults).toYaml(
      "Parameters of localization_node and of the nodelet ttsdf_localization/LocalizationNodelet. Every "
      "value here is the "
      "default: leave out what you do not change. An unknown key or a value out of range is refused with a "
      "message, and "
      "nothing starts.\n"
      "Written from the option tables by the test ros_parameters_test with TTSDF_UPDATE_CONFIG=1; do not "
      "edit.",
      {{"cloud", "Which points of a cloud are used. Distances are from the sensor."},
       {"gates",
        "When a registered scan gives a pose. A refused scan gives a status with the reason and no pose; "
        "after some of "
        "them the state is degraded, then lost."},
       {"motion",
        "The prior of a scan, and how its uncertainty grows. It is kept in directions about which a scan "
        "says nothing (along "
        "a corridor), and the covariance says so."},
       {"recovery",
        "The way back: search near the prior, then global localization, then waiting for a pose."},
       {"registration", "One scan against the map, from the prior."},
       {"search", "Many starts around a prior: start poses, recovery, ~relocalize."},
       {"global", "No prior at all: ~global_localization, and by itself as recovery/ says."}});
}

LocalizationRosOptions loadLocalizationOptions(const ros::NodeHandle& private_node) {
  LocalizationRosOptions options;
  localizationParameters(options).load(private_node);
  checkAndTidy(options);
  return options;
}

void checkAndTidy(LocalizationRosOptions& options) {
  FrameOptions& frames = options.frames;
  for (std::string* frame : {&frames.global_frame_id, &frames.odom_frame_id, &frames.base_frame_id,
                             &options.gravity.gravity_frame_id}) {
    *frame = withoutLeadingSlash(*frame);
  }
  if (frames.odom_frame_id == "none") frames.odom_frame_id.clear();
  if (frames.global_frame_id.empty())
    throw std::invalid_argument("option 'global_frame_id': got '', wanted a frame");
  if (frames.base_frame_id.empty())
    throw std::invalid_argument("option 'base_frame_id': got '', wanted a frame");
  if (frames.odom_frame_id == frames.global_frame_id || frames.base_frame_id == frames.global_frame_id ||
      frames.base_frame_id == frames.odom_frame_id) {
    throw std::invalid_argument("options 'global_frame_id', 'odom_frame_id', 'base_frame_id': got '" +
                                frames.global_frame_id + "', '" + frames.odom_frame_id + "', '" +
                                frames.base_frame_id + "', wanted three different frames");
  }
  MotionOptions& motion = options.localizer.motion;
  if (motion.prior == "odometry" && frames.odom_frame_id.empty()) motion.prior = "constant_velocity";
  if (motion.prior == "external" && frames.tf_broadcast) {
    throw std::invalid_argument(
        "option 'motion/prior': got external, which takes " + frames.global_frame_id + " -> " +
        frames.base_frame_id +
        " from somebody else, together with 'tf_broadcast' true; wanted 'tf_broadcast' false");
  }
  if (words(options.input.clouds).empty() && words(options.input.depth_images).empty()) {
    throw std::invalid_argument(
        "options 'clouds', 'depth_images': got none, wanted a topic to take scans from");
  }
  if (options.cloud.min_range >= options.cloud.max_range) {
    throw std::invalid_argument(
        "option 'cloud/min_range': got " + std::to_string(options.cloud.min_range) +
        ", wanted less than 'cloud/max_range' = " + std::to_string(options.cloud.max_range));
  }
  const GravityOptions& gravity = options.gravity;
  if (gravity.gravity_source == "frame" && gravity.gravity_frame_id.empty()) {
    throw std::invalid_argument(
        "option 'gravity_frame_id': got '', wanted a frame for 'gravity_source' frame");
  }
  if (gravity.gravity_source == "vector" &&
      std::hypot(gravity.gravity_x, gravity.gravity_y, gravity.gravity_z) < 1e-3) {
    throw std::invalid_argument("options 'gravity_x', 'gravity_y', 'gravity_z': got 0, wanted a direction");
  }
  validate(options.localizer);
}

}  // namespace ttsdf

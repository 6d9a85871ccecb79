#pragma once
// Everything config/localization.yaml can say. Groups are nested structs; defaults stand here and nowhere
// else.

#include <string>
#include <vector>

#include "ros/messages/cloud_conversion.h"
#include "ros/parameters/parameters.h"
#include "ttsdf_localization/localization/localizer_options.h"

namespace ttsdf {

/// Frames and transforms, named as in amcl.
struct FrameOptions {
  std::string global_frame_id = "map";
  std::string odom_frame_id = "odom";  ///< "none" is read as "": no odometry, map -> base is published
  std::string base_frame_id = "base_link";
  bool tf_broadcast = true;
  double transform_tolerance = 0.1;  ///< map -> odom is stamped this far ahead of the scan [s]
  double tf_rate = 30.0;             ///< the transform is sent again at this rate [Hz]
  int tf_queue_size = 100;           ///< reduced scans that wait for their transforms
  double odometry_timeout = 0.5;  ///< scans go on without odometry after this time without it [s]; 0: never
};

/// Where the map comes from.
struct MapSourceOptions {
  std::string map_source = "file";   ///< file | topic (ttsdf_map) | service (get_map) | atlas | atlas_server
  std::string map_file;              ///< "": wait for ~load_map or ~set_map
  std::string map_folder;            ///< "": anywhere; otherwise ~load_map takes files of this folder only
  std::string atlas_folder;          ///< of map_source atlas: holds atlas.yaml
  double atlas_megabytes = 60.0;     ///< of all maps of the atlas in memory
  double atlas_timeout = 5.0;        ///< of one call to the server of an atlas [s]
  double atlas_radius = 6.0;         ///< maps at most this far from the robot are in use [m]
  double max_map_megabytes = 256.0;  ///< reading a map may take so much memory
  double max_map_voxels = 4e9;       ///< larger grids are refused
  double memory_megabytes = 4.0;     ///< everything that the map takes, as far as it can be less
};

/// Pose at the start.
struct StartPoseOptions {
  bool set_initial_pose = false;  ///< the numbers below are the start pose of the base in the map
  double initial_pose_x = 0.0, initial_pose_y = 0.0, initial_pose_z = 0.0;           ///< [m]
  double initial_pose_roll = 0.0, initial_pose_pitch = 0.0, initial_pose_yaw = 0.0;  ///< [rad]
  std::string pose_file;          ///< the last good pose is kept here and read at the start; "": not kept
  double save_pose_period = 2.0;  ///< [s]
};

/// Which way is down, for global localization.
struct GravityOptions {
  std::string gravity_source = "auto";                       ///< auto | none | frame | vector | imu
  std::string gravity_frame_id;                              ///< frame: its -z axis is down
  double gravity_x = 0.0, gravity_y = 0.0, gravity_z = 0.0;  ///< vector: down in the cloud's frame
};

/// What is published and when somebody is warned.
struct OutputOptions {
  double quiet_warning_seconds = 15.0;  ///< without scans or transforms: a warning [s]
  int path_length = 10000;              ///< poses kept in the path
  double path_spacing = 0.02;           ///< least distance between two of them [m]
};

/// Where scans come from.
struct InputOptions {
  std::string clouds = "cloud";  ///< topics of PointCloud2, by blanks; one localizer may have several cameras
  std::string depth_images;      ///< topics of depth images, by blanks; camera_info is beside each
};

/// Which scans are used while the robot is tracked.
struct UpdateOptions {
  double max_rate = 0.0;      ///< at most so many scans [Hz]; 0: all
  double update_min_d = 0.0;  ///< a scan is used when the base moved this far since the last one used [m] ...
  double update_min_a = 0.0;  ///< ... or turned this far [rad]; both 0: always
};

struct LocalizationRosOptions {
  FrameOptions frames;
  InputOptions input;
  UpdateOptions update;
  MapSourceOptions map;
  StartPoseOptions start;
  GravityOptions gravity;
  OutputOptions output;
  CloudOptions cloud;
  LocalizerOptions localizer;
};

const OptionTable<FrameOptions>& frameOptionTable();
const OptionTable<InputOptions>& inputOptionTable();
const OptionTable<UpdateOptions>& updateOptionTable();
const OptionTable<MapSourceOptions>& mapSourceOptionTable();
const OptionTable<StartPoseOptions>& startPoseOptionTable();
const OptionTable<GravityOptions>& gravityOptionTable();
const OptionTable<OutputOptions>& outputOptionTable();

/// Of a list in one text, by blanks.
std::vector<std::string> words(const std::string& text);

/// Registers every option under the keys of the YAML file; `options` must outlive the set.
ParameterSet localizationParameters(LocalizationRosOptions& options);

/// True for what may change while the localizer runs: gates, rates, budgets; not frames, topics and the map's
/// registration.
bool isLive(const std::string& key);

/// config/localization.yaml as it should be: every option with its default and its meaning.
std::string localizationYaml();

/// Reads and checks. Throws std::invalid_argument naming every bad key.
LocalizationRosOptions loadLocalizationOptions(const ros::NodeHandle& private_node);

/// What single values cannot say: options that contradict each other. Strips leading slashes of frames.
void checkAndTidy(LocalizationRosOptions& options);

}  // namespace ttsdf

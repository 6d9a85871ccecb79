#pragma once
// Parameters of the map builder node. Groups are sub-namespaces: ~selection/every, ~fusion/voxel_size,
// ~build/max_rank.

#include <ros/node_handle.h>

#include <string>

#include "ros/builder/scan_fuser.h"
#include "ros/parameters/parameters.h"
#include "ros/scans/scan_selector.h"
#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct MapBuilderRosOptions {
  std::string global_frame_id = "map";  ///< the map's frame
  std::string map_file;                 ///< loaded at the start; empty: none
  std::string map_folder;               ///< "": anywhere; otherwise every path of a request lies in it
  std::string
      checkpoint_file;  ///< .vdb: the fused volume is kept here and taken up again at the start; "": not kept
  double checkpoint_period = 60.0;  ///< [s]
  double surface_period =
      3.0;  ///< new surface of what is being fused, while somebody subscribes [s]; 0: never
  int surface_triangles = 300000;  ///< a larger surface is thinned for display
  double slice_height = 1.0;       ///< of ~slice, map frame [m]
  double quiet_seconds = 15.0;     ///< no cloud or no transform for this long: a warning [s]
  ScanFuserOptions queue;
  ScanSelectionOptions selection;
  FusionOptions fusion;
  BuildOptions build;
};
/// The fields of MapBuilderRosOptions itself and of `queue`.
const OptionTable<MapBuilderRosOptions>& mapBuilderRosOptionTable();

/// Registers every option under the keys of the YAML file; `options` must outlive the set.
ParameterSet mapBuilderParameters(MapBuilderRosOptions& options);

/// config/map_builder.yaml as it should be: every option with its default and its meaning.
std::string mapBuilderYaml();

/// Reads and checks every group. Throws std::invalid_argument naming key, value and range.
MapBuilderRosOptions loadMapBuilderOptions(const ros::NodeHandle& private_nh);

}  // namespace ttsdf

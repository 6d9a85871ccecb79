#include "ros/builder/map_builder_options.h"

#include "ros/messages/conversions.h"

namespace ttsdf {

const OptionTable<MapBuilderRosOptions>& mapBuilderRosOptionTable() {
  using Options = MapBuilderRosOptions;
  static const OptionTable<Options> table =
      OptionTable<Options>()
          .add("global_frame_id", &Options::global_frame_id, {},
               "The map's frame; TF must give the sensor's pose in it at every cloud's stamp.")
          .add("map_file", &Options::map_file, {}, "Map file loaded at the start; empty: none.")
          .add("map_folder", &Options::map_folder, {},
               "Every path of a request lies in this folder: no way out by '..' or a link. Empty: any path.")
          .add("checkpoint_file", &Options::checkpoint_file, {},
               "The fused volume is kept in this .vdb file and taken up again at the start; ~reset removes "
               "it. Empty: "
               "not kept.")
          .add("checkpoint_period", &Options::checkpoint_period, 0.1, 86400.0, "s",
               "How often it is written, if something was fused meanwhile.")
          .add("surface_period", &Options::surface_period, 0.0, 3600.0, "s",
               "New surface of what is being fused, while somebody subscribes ~surface; 0: never.")
          .add("surface_triangles", &Options::surface_triangles, 100, 10000000, "",
               "A surface with more triangles is thinned for display.")
          .add("slice_height", &Options::slice_height, -1e4, 1e4, "m", "Height of ~slice in the map's frame.")
          .add("quiet_seconds", &Options::quiet_seconds, 1.0, 1e6, "s",
               "Warn after this time without a cloud or without a transform.")
          .add(&Options::queue, scanFuserOptionTable());
  return table;
}

ParameterSet mapBuilderParameters(MapBuilderRosOptions& options) {
  ParameterSet parameters;
  parameters.add("", options, mapBuilderRosOptionTable());
  parameters.add("selection", options.selection, scanSelectionOptionTable());
  parameters.add("fusion", options.fusion, fusionOptionTable());
  parameters.add("build", options.build, buildOptionTable());
  parameters.ignore("diagnostic_period");  // diagnostic_updater's
  return parameters;
}

std::string mapBuilderYaml() {
  MapBuilderRosOptions defaults;
  return mapBuilderParameters(defaults).toYaml(
      "Parameters of map_builder_node and of the nodelet ttsdf_localization/MapBuilderNodelet. Every value "
      "here is the default: leave out what you do not change. An unknown key or a value out of range is "
      "refused with a message, and nothing starts.\n"
      "Written from the option tables by the test ros_map_builder_config_test with TTSDF_UPDATE_CONFIG=1; do "
      "not edit.",
      {{"selection", "Which clouds are fused. A camera that stands still adds nothing but time."},
       {"fusion", "Fusion into the truncated signed distance volume."},
       {"build", "Compression; the service ~build_map can override each of these."}});
}

MapBuilderRosOptions loadMapBuilderOptions(const ros::NodeHandle& private_nh) {
  MapBuilderRosOptions options;
  mapBuilderParameters(options).load(private_nh);
  options.global_frame_id = withoutLeadingSlash(options.global_frame_id);
  return options;
}

}  // namespace ttsdf

#include "ttsdf_localization/ros/map_builder_options.h"

#include "ttsdf_localization/ros/conversions.h"
#include "ttsdf_localization/ros/parameters.h"

namespace ttsdf {

const OptionTable<MapBuilderRosOptions>& mapBuilderRosOptionTable() {
  using Options = MapBuilderRosOptions;
  static const OptionTable<Options> table =
      OptionTable<Options>()
          .add("global_frame_id", &Options::global_frame_id, {},
               "the map's frame; TF gives the sensor's pose in it")
          .add("map_file", &Options::map_file, {}, "map file loaded at the start; empty: none")
          .add("surface_period", &Options::surface_period, 0.0, 3600.0, "s",
               "new surface of what is being fused, while somebody subscribes ~surface; 0: never")
          .add("surface_triangles", &Options::surface_triangles, 100, 10000000, "",
               "a surface with more triangles is thinned for display")
          .add("slice_height", &Options::slice_height, -1e4, 1e4, "m", "height of ~slice in the map's frame")
          .add("quiet_seconds", &Options::quiet_seconds, 1.0, 1e6, "s",
               "warn after this time without a cloud or without a transform")
          .add(&Options::queue, scanFuserOptionTable());
  return table;
}

MapBuilderRosOptions loadMapBuilderOptions(const ros::NodeHandle& private_nh) {
  MapBuilderRosOptions options;
  ParameterSet parameters;
  parameters.add("", options, mapBuilderRosOptionTable());
  parameters.add("selection", options.selection, scanSelectionOptionTable());
  parameters.add("fusion", options.fusion, fusionOptionTable());
  parameters.add("build", options.build, buildOptionTable());
  parameters.ignore("diagnostic_period");  // diagnostic_updater's
  parameters.load(private_nh);
  options.global_frame_id = withoutLeadingSlash(options.global_frame_id);
  return options;
}

}  // namespace ttsdf

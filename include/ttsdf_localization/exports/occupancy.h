#pragma once
// A map seen from above, for planners: the grid of map_server and nav_msgs/OccupancyGrid.

#include <cstdint>
#include <string>
#include <vector>

#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

struct OccupancyOptions {
  double resolution = 0.0;  ///< edge of a cell [m]; 0: the map's voxel size, at least 2 cm
  double min_height =
      -1e9;  ///< z of the map frame that obstacles count from [m]; below the map: its lowest sample
  double max_height = 1e9;  ///< ... and up to
};

struct OccupancyImage {
  enum Cell : std::int8_t { kUnknown = -1, kFree = 0, kOccupied = 100 };  // as nav_msgs/OccupancyGrid

  int width = 0, height = 0;
  double resolution = 0.0;                           ///< [m]
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< lower left corner of cell (0, 0), map frame [m]
  std::vector<std::int8_t> cells;                    ///< row by row from the lowest y, x fastest
};

/// Occupied: surface or matter somewhere in the range of heights. Free: known all over, or at least
/// somewhere, and nothing in the way. The rest is unknown. Throws std::invalid_argument: no height left, a
/// resolution that is not positive or that makes more than 10^8 cells.
OccupancyImage occupancyOf(const TtSdfMap& map, const OccupancyOptions& options);

struct OccupancyFiles {
  std::string image, yaml;
};
/// NAME.pgm and NAME.yaml; `name` may be either of them.
OccupancyFiles occupancyFiles(const std::string& name);

/// The files of occupancyFiles(), as map_server reads them. Throws std::runtime_error.
void writeOccupancy(const OccupancyImage& image, const std::string& name);

}  // namespace ttsdf

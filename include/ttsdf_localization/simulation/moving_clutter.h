#pragma once
// People-sized boxes that walk to and fro: what stands in front of the map and is not in it.

#include <Eigen/Geometry>
#include <vector>

#include "ttsdf_localization/options/option_table.h"
#include "ttsdf_localization/simulation/solid.h"

namespace ttsdf {

struct ClutterOptions {
  int people = 0;              ///< boxes of 0.5 x 0.35 x 1.75 m
  double walking_speed = 0.8;  ///< [m/s]
  double near = 1.0;           ///< they keep in front of the camera between this ...
  double far = 2.5;            ///< ... and this distance [m]
  int clutter_seed = 1;
};
const OptionTable<ClutterOptions>& clutterOptionTable();

/// People who walk with the camera, each on a path of his own that crosses its view: clutter that stays in
/// the picture wherever the camera goes. They pass through furniture: they are there to be in the way.
class MovingClutter {
 public:
  /// Throws std::invalid_argument for bad options.
  explicit MovingClutter(const ClutterOptions& options = {});

  /// The boxes at a time [s], for a camera whose body (x forward, z up) is at `T_map_base` above a floor at
  /// `floor_z`.
  std::vector<Solid> at(double time, const Eigen::Isometry3d& T_map_base, double floor_z = 0.0) const;

 private:
  struct Person {
    double distance, period, phase, turn, height;
  };
  ClutterOptions options_;
  std::vector<Person> people_;
};

}  // namespace ttsdf

#pragma once
// Builds scenes from walls, slabs and furniture. Everything that joins overlaps by `kEmbed`, so that the
// union has no zero crossing inside matter (see analytic_scene.h). z is up, lengths in metres, angles in
// radians.

#include <vector>

#include "ttsdf_localization/simulation/analytic_scene.h"

namespace ttsdf {

/// A door or window: a rectangle cut out of a wall, measured along it from its start and up from its foot
/// [m].
struct WallOpening {
  double begin = 0.0, end = 0.0, bottom = 0.0, top = 0.0;
};

/// Where a piece of furniture stands: the middle of its footprint on the floor; it faces +x of the turned
/// frame.
struct Place {
  double x = 0.0, y = 0.0, z = 0.0;  ///< [m]
  double yaw = 0.0;                  ///< [rad]
};

class SceneBuilder {
 public:
  static constexpr double kEmbed = 0.05;  ///< overlap of what joins [m]

  /// Axis-parallel box between two corners.
  void box(const Eigen::Vector3d& min, const Eigen::Vector3d& max);
  /// Box whose underside is centred at `place` (turned by its yaw).
  void boxAt(const Place& place, const Eigen::Vector3d& size);
  /// Box anywhere, for slanted things.
  void turnedBox(const Eigen::Vector3d& center, const Eigen::Vector3d& size,
                 const Eigen::Vector3d& roll_pitch_yaw);
  /// Upright cylinder that stands at `place`.
  void post(const Place& place, double radius, double height);
  void sphere(const Eigen::Vector3d& center, double radius);

  /// Upright wall along the centre line from -> to, from height `bottom` to `top`. It reaches half its
  /// thickness past both ends (corners close) and kEmbed into floor and ceiling. Throws std::invalid_argument
  /// for an opening that does not lie in the wall.
  void wall(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double bottom, double top,
            double thickness, const std::vector<WallOpening>& openings = {});

  // Furniture; `size` = depth (along the facing direction), width, height.
  void table(const Place& place, const Eigen::Vector3d& size);
  void chair(const Place& place);
  void sofa(const Place& place, double width);
  void bed(const Place& place, double width);
  /// Open shelf with `boards` boards above its foot; things of different size stand on them, varied by
  /// `variant`.
  void shelf(const Place& place, const Eigen::Vector3d& size, int boards, int variant);
  /// Closed cabinet with doors that stand out and handles.
  void cabinet(const Place& place, const Eigen::Vector3d& size, int doors);
  void lamp(const Place& place, double height);
  void plant(const Place& place, double height);
  /// Flat panel on a wall: picture, screen, mirror. `place` is the middle of its lower edge, facing the room.
  void panel(const Place& place, double width, double height);
  void radiator(const Place& place, double width);
  /// Steps that climb towards +x of the turned frame, solid down to the floor.
  void stairs(const Place& place, double width, double run, double rise, int steps);

  AnalyticScene build() const { return AnalyticScene(solids_); }

 private:
  /// Box with corners in the frame of a place.
  void part(const Place& place, const Eigen::Vector3d& min, const Eigen::Vector3d& max);

  std::vector<Solid> solids_;
};

}  // namespace ttsdf

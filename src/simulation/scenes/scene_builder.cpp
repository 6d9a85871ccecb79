#include "ttsdf_localization/simulation/scene_builder.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace ttsdf {

namespace {

Eigen::Isometry3d frameOf(const Place& place) {
  return Eigen::Translation3d(place.x, place.y, place.z) *
         Eigen::AngleAxisd(place.yaw, Eigen::Vector3d::UnitZ());
}

/// A rectangle in the plane of a wall: s along it, z up.
struct Rectangle {
  double s_min, s_max, z_min, z_max;
};

/// Which cells of the grid spanned by all edges of the openings are wall.
class WallGrid {
 public:
  WallGrid(const Rectangle& wall, const std::vector<WallOpening>& openings) : openings_(openings) {
    s_ = {wall.s_min, wall.s_max};
    z_ = {wall.z_min, wall.z_max};
    for (const auto& o : openings) {
      s_.insert(s_.end(), {o.begin, o.end});
      z_.insert(z_.end(), {o.bottom, o.top});
    }
    for (auto* edges : {&s_, &z_}) {
      std::sort(edges->begin(), edges->end());
      edges->erase(std::unique(edges->begin(), edges->end()), edges->end());
    }
  }

  /// All rectangles of wall that cannot be made larger: together they cover the wall, and they overlap rather
  /// than touch.
  std::vector<Rectangle> maximalRectangles() const {
    std::vector<Rectangle> found;
    const int columns = static_cast<int>(s_.size()) - 1, rows = static_cast<int>(z_.size()) - 1;
    for (int a = 0; a < columns; ++a) {
      for (int b = a; b < columns; ++b) {
        for (int c = 0; c < rows; ++c) {
          for (int d = c; d < rows; ++d) {
            if (!solid(a, b, c, d)) continue;
            const bool larger = (a > 0 && solid(a - 1, b, c, d)) ||
                                (b + 1 < columns && solid(a, b + 1, c, d)) ||
                                (c > 0 && solid(a, b, c - 1, d)) || (d + 1 < rows && solid(a, b, c, d + 1));
            if (!larger) found.push_back({edge(s_, a), edge(s_, b + 1), edge(z_, c), edge(z_, d + 1)});
          }
        }
      }
    }
    return found;
  }

 private:
  static double edge(const std::vector<double>& edges, int i) { return edges[static_cast<std::size_t>(i)]; }

  bool solid(int a, int b, int c, int d) const {
    for (const auto& o : openings_) {
      if (o.begin < edge(s_, b + 1) && o.end > edge(s_, a) && o.bottom < edge(z_, d + 1) &&
          o.top > edge(z_, c)) {
        return false;
      }
    }
    return true;
  }

  const std::vector<WallOpening>& openings_;
  std::vector<double> s_, z_;
};

}  // namespace

void SceneBuilder::box(const Eigen::Vector3d& min, const Eigen::Vector3d& max) { part({}, min, max); }

void SceneBuilder::boxAt(const Place& place, const Eigen::Vector3d& size) {
  const double x = 0.5 * size.x(), y = 0.5 * size.y();
  part(place, {-x, -y, 0.0}, {x, y, size.z()});
}

void SceneBuilder::turnedBox(const Eigen::Vector3d& center, const Eigen::Vector3d& size,
                             const Eigen::Vector3d& roll_pitch_yaw) {
  const Eigen::Isometry3d T = Eigen::Translation3d(center) *
                              Eigen::AngleAxisd(roll_pitch_yaw.z(), Eigen::Vector3d::UnitZ()) *
                              Eigen::AngleAxisd(roll_pitch_yaw.y(), Eigen::Vector3d::UnitY()) *
                              Eigen::AngleAxisd(roll_pitch_yaw.x(), Eigen::Vector3d::UnitX());
  solids_.push_back(Solid::box(T, size));
}

void SceneBuilder::post(const Place& place, double radius, double height) {
  solids_.push_back(
      Solid::cylinder(frameOf(place) * Eigen::Translation3d(0.0, 0.0, 0.5 * height), radius, height));
}

void SceneBuilder::sphere(const Eigen::Vector3d& center, double radius) {
  solids_.push_back(Solid::sphere(center, radius));
}

void SceneBuilder::part(const Place& place, const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
  solids_.push_back(Solid::box(frameOf(place) * Eigen::Translation3d(0.5 * (min + max)), max - min));
}

void SceneBuilder::wall(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double bottom, double top,
                        double thickness, const std::vector<WallOpening>& openings) {
  const double length = (to - from).norm();
  const Rectangle whole{-0.5 * thickness, length + 0.5 * thickness, -kEmbed, top - bottom + kEmbed};
  for (const auto& o : openings) {
    if (!(o.begin < o.end && o.bottom < o.top && o.begin > 0.0 && o.end < length && o.bottom >= 0.0 &&
          o.top <= top - bottom)) {
      std::ostringstream message;
      message << "wall opening: got [" << o.begin << ", " << o.end << "] x [" << o.bottom << ", " << o.top
              << "] m, wanted a rectangle inside a wall of " << length << " x " << top - bottom << " m";
      throw std::invalid_argument(message.str());
    }
  }
  const Eigen::Vector2d along = (to - from) / length;
  const Place start{from.x(), from.y(), bottom, std::atan2(along.y(), along.x())};
  for (const Rectangle& r : WallGrid(whole, openings).maximalRectangles()) {
    part(start, {r.s_min, -0.5 * thickness, r.z_min}, {r.s_max, 0.5 * thickness, r.z_max});
  }
}

}  // namespace ttsdf

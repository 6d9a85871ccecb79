#include "ttsdf_localization/simulation/moving_clutter.h"

#include <cmath>
#include <random>
#include <sstream>
#include <stdexcept>

#include "scenes/headings.h"

namespace ttsdf {

namespace {
constexpr double kDepth = 0.35, kWidth = 0.5;  ///< of a person [m]
constexpr double kHalfAngle = 0.5;  ///< to either side of the camera's axis that people cross [rad]
}  // namespace

const OptionTable<ClutterOptions>& clutterOptionTable() {
  using O = ClutterOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("people", &O::people, 0, 50, "", "People-sized boxes that walk in front of the camera.")
          .add("walking_speed", &O::walking_speed, 0.0, 5.0, "m/s", "Speed of those boxes.")
          .add("near", &O::near, 0.5, 20.0, "m", "Smallest distance of a box from the camera.")
          .add("far", &O::far, 0.5, 20.0, "m", "Largest distance of a box from the camera.")
          .add("clutter_seed", &O::clutter_seed, 0, 1000000000, "", "Seed of the boxes' paths.");
  return kTable;
}

MovingClutter::MovingClutter(const ClutterOptions& options) : options_(options) {
  clutterOptionTable().validate(options);
  if (options.far < options.near) {
    std::ostringstream message;
    message << "clutter: got far " << options.far << " m, wanted at least near (" << options.near << " m)";
    throw std::invalid_argument(message.str());
  }
  std::mt19937_64 random(static_cast<std::uint64_t>(options.clutter_seed));
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int i = 0; i < options.people; ++i) {
    Person person{};
    person.distance = options.near + (options.far - options.near) * share(random);
    // To and fro over the arc at the walking speed on average.
    person.period = 4.0 * kHalfAngle * person.distance / std::max(options.walking_speed, 1e-3);
    person.phase = share(random);
    person.turn = kPi * share(random);
    person.height = 1.6 + 0.3 * share(random);
    people_.push_back(person);
  }
}

std::vector<Solid> MovingClutter::at(double time, const Eigen::Isometry3d& T_map_base, double floor_z) const {
  const Eigen::Vector3d forward = T_map_base.linear().col(0);
  const double heading = std::atan2(forward.y(), forward.x());
  std::vector<Solid> boxes;
  for (const Person& person : people_) {
    const double angle = heading + kHalfAngle * std::sin(2.0 * kPi * (time / person.period + person.phase));
    const Eigen::Vector3d middle =
        T_map_base.translation() + person.distance * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    const Eigen::Isometry3d T = Eigen::Translation3d(middle.x(), middle.y(), floor_z + 0.5 * person.height) *
                                Eigen::AngleAxisd(heading + person.turn, Eigen::Vector3d::UnitZ());
    boxes.push_back(Solid::box(T, {kDepth, kWidth, person.height}));
  }
  return boxes;
}

}  // namespace ttsdf

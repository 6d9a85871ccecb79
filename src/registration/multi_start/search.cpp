#include "ttsdf_localization/registration/search.h"

#include <algorithm>
#include <chrono>

#include "../result.h"
#include "multi_start.h"
#include "start_poses.h"

namespace ttsdf {

const OptionTable<SearchOptions>& searchOptionTable() {
  using O = SearchOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("starts", &O::starts, 1, 100000, "", "Starts around the prior")
          .add("translation_sigma", &O::translation_sigma, 0.0, 100.0, "m",
               "Spread of the starts around the prior")
          .add("rotation_sigma", &O::rotation_sigma, 0.0, 3.2, "rad", "Spread of the starts around the prior")
          .add("coarse_points", &O::coarse_points, 6, 100000, "", "Points of the cheap descents")
          .add("refined", &O::refined, 1, 1000, "", "Best starts that are refined on all points")
          .add("seed", &O::seed, 0, 2147483647, "", "Seed of the starts");
  return table;
}

RegistrationResult searchNear(Registration& registration, const ScanPoints& points,
                              const Eigen::Isometry3d& T_map_sensor_prior, const SearchOptions& options,
                              const std::optional<Matrix6d>& covariance) {
  const auto begin = std::chrono::steady_clock::now();
  searchOptionTable().validate(options);
  const MultiStart search(registration, points, options.coarse_points);
  if (search.points() < 6 || !T_map_sensor_prior.matrix().allFinite())
    return registration.align(points, T_map_sensor_prior);

  Matrix6d spread = Matrix6d::Zero();
  spread.diagonal().head<3>().setConstant(options.rotation_sigma * options.rotation_sigma);
  spread.diagonal().tail<3>().setConstant(options.translation_sigma * options.translation_sigma);
  const GridGeometry& geometry = registration.field().geometry();  // descents are relative to its origin
  const auto starts = startsAround(relativeTo(geometry, T_map_sensor_prior), covariance.value_or(spread),
                                   options.starts, options.seed);

  MultiStart::Options around;
  around.refined = static_cast<std::size_t>(options.refined);
  std::vector<Eigen::Isometry3d> found{T_map_sensor_prior};
  for (const Eigen::Isometry3d& T : search.places(starts, around)) found.push_back(T);
  RegistrationResult best = registration.alignFrom(
      points, found, PosePrior::fromCovariance(T_map_sensor_prior, covariance.value_or(spread)));
  best.milliseconds =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return best;
}

}  // namespace ttsdf

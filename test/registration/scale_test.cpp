// An object in the hand, rooms at several voxel sizes, a hall: nothing but the sensor's name is set.

#include <gtest/gtest.h>

#include "analytic_world.h"
#include "ttsdf_localization/registration/registration.h"
#include "ttsdf_localization/registration/search.h"

namespace ttsdf {
namespace {

struct Place {
  const char* name;
  Eigen::Vector3d size;  ///< [m]
  double voxel, noise;   ///< [m]
  const char* sensor;
};
void PrintTo(const Place& place, std::ostream* out) { *out << place.name; }

const Place kPlaces[] = {
    {"object of 0.3 m at 2 mm", {0.3, 0.225, 0.18}, 0.002, 0.0002, "exact"},
    {"room at 1 cm", {4.0, 3.0, 2.4}, 0.01, 0.004, "kinect"},
    {"room at 2 cm", {4.0, 3.0, 2.4}, 0.02, 0.004, "kinect"},
    {"room at 5 cm", {4.0, 3.0, 2.4}, 0.05, 0.004, "kinect"},
    {"room at 10 cm", {4.0, 3.0, 2.4}, 0.10, 0.004, "kinect"},
    {"hall of 60 m at 10 cm", {60.0, 24.0, 8.0}, 0.10, 0.02, "lidar"},
};

/// The furnished room, stretched to the size of the place. Stretched by unlike factors a distance is a bound,
/// which rays may follow; so shapes are drawn anew from boxes.
double signedDistance(const Place& place, const Eigen::Vector3d& p) {
  const Eigen::Vector3d s = place.size.cwiseQuotient(Eigen::Vector3d(4.0, 3.0, 2.4));
  const auto box = [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& half) {
    return test::boxSdf(p, centre.cwiseProduct(s), half.cwiseProduct(s));
  };
  const double walls = std::min(p.minCoeff(), (place.size - p).minCoeff());
  return std::min({walls, box({0.6, 0.4, 0.4}, {0.6, 0.4, 0.4}), box({3.7, 2.0, 0.9}, {0.3, 0.5, 0.9}),
                   box({1.8, 2.75, 0.5}, {0.5, 0.25, 0.5}),
                   (p - Eigen::Vector3d(2.2, 1.4, 0.2).cwiseProduct(s)).norm() - 0.35 * s.minCoeff()});
}

class Scale : public ::testing::TestWithParam<Place> {
 protected:
  Scale() {
    GridGeometry geometry;
    geometry.voxel_size = GetParam().voxel;
    geometry.dims = (GetParam().size.array() / geometry.voxel_size + 9.5).cast<int>();
    geometry.T_map_grid.translation().setConstant(-4.0 * geometry.voxel_size);
    RegistrationOptions options;
    options.sensor = GetParam().sensor;
    const auto sdf = [this](const Eigen::Vector3d& p) { return signedDistance(GetParam(), p); };
    registration_ = std::make_unique<Registration>(test::denseField(sdf, geometry), options);
    for (unsigned seed = 0; poses_.size() < 12; ++seed) {
      Eigen::Isometry3d T = test::roomPose(seed);
      T.translation() =
          T.translation().cwiseProduct(GetParam().size.cwiseQuotient(Eigen::Vector3d(4.0, 3.0, 2.4)));
      if (sdf(T.translation()) < 0.1 * GetParam().size.z()) continue;
      poses_.push_back(T);
      scans_.push_back(test::castRays(sdf, T, test::directions(2000), GetParam().noise, seed));
    }
  }

  std::unique_ptr<Registration> registration_;
  std::vector<Eigen::Isometry3d> poses_;
  std::vector<Eigen::Matrix3Xf> scans_;
};

// A twentieth of the place off (3 m in the hall), and a tenth of a radian.
TEST_P(Scale, ComesBackToTheTruth) {
  const double away = 0.05 * GetParam().size.x();
  int found = 0;
  for (std::size_t n = 0; n < poses_.size(); ++n) {
    const auto prior = test::perturbed(poses_[n], away, 0.1, static_cast<unsigned>(n));
    const RegistrationResult result = registration_->align(scans_[n], prior);
    if (!result.success) continue;
    ++found;
    const PoseError error = poseError(poses_[n], result.T_map_sensor);
    EXPECT_LT(error.translation, 0.25 * GetParam().voxel) << n << ": accepted and wrong";
    EXPECT_LT(error.rotation, GetParam().voxel / GetParam().size.x()) << n << ": accepted and wrong";
  }
  EXPECT_GE(found, 11) << "of 12";
}

TEST_P(Scale, FindsItselfWithoutAPrior) {
  int found = 0;
  for (std::size_t n = 0; n < poses_.size(); ++n) {
    const Eigen::Vector3d down = poses_[n].linear().transpose() * -Eigen::Vector3d::UnitZ();
    const RegistrationResult result =
        localizeGlobally(*registration_, scans_[n], down, -Eigen::Vector3d::UnitZ(), {});
    const double error = poseError(poses_[n], result.T_map_sensor).translation;
    if (!result.success) continue;
    ++found;
    EXPECT_LT(error, GetParam().voxel) << n << ": accepted and wrong";
  }
  EXPECT_GE(found, 11) << "of 12";
}

INSTANTIATE_TEST_SUITE_P(Places, Scale, ::testing::ValuesIn(kPlaces));

}  // namespace
}  // namespace ttsdf

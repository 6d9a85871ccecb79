// Maps that know a part of a place: what lies in the other part must not decide.

#include <gtest/gtest.h>

#include "analytic_world.h"
#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {
namespace {

constexpr double kVoxel = 0.05;

/// The furnished room, of which only x > `from` [m] was seen.
std::shared_ptr<const DistanceField> roomKnownFrom(double from) {
  const GridGeometry geometry = test::roomGeometry(kVoxel);
  constexpr int kCell = 4;
  SupportMask mask(geometry.dims, kCell, false);
  for (int i = 0; i < mask.cellDims()[0]; ++i) {
    if (geometry.samplePosition(Eigen::Vector3d(kCell * i, 0, 0)).x() < from) continue;
    for (int j = 0; j < mask.cellDims()[1]; ++j) {
      for (int k = 0; k < mask.cellDims()[2]; ++k) mask.set(i, j, k, true);
    }
  }
  return test::denseField(test::furnishedRoom, geometry, std::move(mask));
}

// More of a scan may lie in the known part at another place, and fit badly there.
TEST(PartialMap, FurtherHypothesesTakeNoVerifiedPoseAway) {
  const auto field = roomKnownFrom(1.5);
  RegistrationOptions nearby;
  nearby.long_range = false, nearby.restarts = 0;
  Registration all(field, {}), near_only(field, nearby);
  int found = 0;
  for (unsigned seed = 80; seed < 120; ++seed) {
    const Eigen::Isometry3d truth = test::roomPose(seed);
    const Eigen::Matrix3Xf points =
        test::castRays(test::furnishedRoom, truth, test::directions(1500), 0.005, seed);
    const Eigen::Isometry3d prior = test::perturbed(truth, 0.05, 0.03, seed + 100);
    const RegistrationResult expected = near_only.align(points, prior);
    const double error = poseError(truth, expected.T_map_sensor).translation;
    if (!expected.success || error > 0.02) continue;
    ++found;
    const RegistrationResult result = all.align(points, prior);
    EXPECT_TRUE(result.success) << "seed " << seed << ", " << 100.0 * expected.unmappedRatio()
                                << " % of the points are not mapped, " << name(result.reason);
    EXPECT_LT(poseError(truth, result.T_map_sensor).translation, error + 0.5 * kVoxel) << "seed " << seed;
  }
  EXPECT_GT(found, 20);
}

}  // namespace
}  // namespace ttsdf

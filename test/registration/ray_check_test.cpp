#include "../../src/registration/verification/ray_check.h"

#include <gtest/gtest.h>

#include "analytic_world.h"
#include "ttsdf_localization/field/long_range_field.h"

namespace ttsdf {
namespace {

using namespace test;

class BlockedShare : public testing::Test {
 protected:
  BlockedShare() {
    T_.translation() << 2.2, 2.0, 1.2;
    scan_.assign(castRays(furnishedRoom, T_, directions(2000)), 2000);
  }
  /// By brute force on the exact distance, every millimetre.
  double exact(const Sdf& sdf, const Eigen::Isometry3d& T, double inside, double before_end) const {
    int blocked = 0;
    for (int n = 0; n < scan_.size(); ++n) {
      const Eigen::Vector3d end =
          scan_.centroid() + Eigen::Vector3d(scan_.x()[n], scan_.y()[n], scan_.z()[n]);
      bool hit = false;
      for (double s = 0.0; s < end.norm() - before_end && !hit; s += 1e-3) {
        hit = sdf(T * (s * end.normalized())) < -inside;
      }
      blocked += hit ? 1 : 0;
    }
    return static_cast<double>(blocked) / scan_.size();
  }

  Eigen::Isometry3d T_ = Eigen::Isometry3d::Identity();
  ScanBuffer scan_;
  std::shared_ptr<const DistanceField> field_ = denseField(furnishedRoom, roomGeometry(0.04));
};

TEST_F(BlockedShare, IsNoneAtTheRightPose) {
  EXPECT_EQ(blockedShare(*field_, nullptr, scan_, T_, 2000), 0.0);
}

TEST_F(BlockedShare, AgreesWithBruteForceAtWrongPoses) {
  for (const double shift : {0.3, 0.8, 1.5}) {
    Eigen::Isometry3d T = T_;
    T.translation().x() += shift;
    T.linear() = expSo3(Eigen::Vector3d(0, 0, shift)) * T.linear();
    // Outside the box nothing is known: only matter inside of it blocks.
    const GridGeometry& geometry = field_->geometry();
    const auto known = [&geometry](const Eigen::Vector3d& p) {
      const Eigen::Array3d index = geometry.toIndex(p).array();
      const bool in = (index >= 0.0).all() && (index <= (geometry.dims - 1).cast<double>()).all();
      return in ? furnishedRoom(p) : 1.0;
    };
    const double wanted = exact(known, T, 1.5 * 0.04, 2.5 * 0.04);
    EXPECT_GT(wanted, 0.05) << shift;
    EXPECT_NEAR(blockedShare(*field_, nullptr, scan_, T, 2000), wanted, 0.03) << shift;
  }
}

TEST_F(BlockedShare, LooksAlongAPartOfTheRays) {
  Eigen::Isometry3d T = T_;
  T.translation().x() += 1.5;
  EXPECT_NEAR(blockedShare(*field_, nullptr, scan_, T, 300), blockedShare(*field_, nullptr, scan_, T, 2000),
              0.1);
}

TEST_F(BlockedShare, IsTheSameWithAFarFieldAtHand) {
  const auto far = makeLongRangeField(*field_);
  for (const double shift : {0.0, 0.3, 0.8, 1.5}) {
    Eigen::Isometry3d T = T_;
    T.translation().x() += shift;
    EXPECT_NEAR(blockedShare(*field_, far.get(), scan_, T, 2000),
                blockedShare(*field_, nullptr, scan_, T, 2000), 0.01)
        << shift;
  }
}

TEST_F(BlockedShare, OfNothingIsNone) {
  ScanBuffer none;
  none.assign(Eigen::Matrix3Xf(3, 0), 100);
  EXPECT_EQ(blockedShare(*field_, nullptr, none, T_, 100), 0.0);
}

}  // namespace
}  // namespace ttsdf

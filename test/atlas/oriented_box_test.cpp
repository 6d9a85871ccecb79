#include "ttsdf_localization/atlas/oriented_box.h"

#include <gtest/gtest.h>

#include <random>

#include "ttsdf_localization/atlas/box_tree.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {
namespace {

OrientedBox randomBox(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto vector = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  OrientedBox box;
  box.T_atlas_box.linear() = expSo3(3.0 * vector());
  box.T_atlas_box.translation() = 2.0 * vector();
  box.size = (vector().array() + 1.5).matrix();
  return box;
}

/// Brute force: whether any of many points of one box lies in the other.
bool share(const OrientedBox& a, const OrientedBox& b) {
  constexpr int kAlong = 24;
  for (int n = 0; n < kAlong * kAlong * kAlong; ++n) {
    const Eigen::Array3d part(n % kAlong, n / kAlong % kAlong, n / kAlong / kAlong);
    const Eigen::Vector3d p = (part / (kAlong - 1.0) * a.size.array()).matrix();
    if (b.depth(a.T_atlas_box * p) >= 0.0) return true;
  }
  return false;
}

TEST(OrientedBox, OverlapAgreesWithPointsInBoth) {
  std::mt19937 random(3);
  int overlapping = 0;
  for (int n = 0; n < 200; ++n) {
    const OrientedBox a = randomBox(random), b = randomBox(random);
    const double depth = overlapDepth(a, b);
    EXPECT_NEAR(depth, overlapDepth(b, a), 1e-9);
    if (depth > 0.15) {
      EXPECT_TRUE(share(a, b));
    }
    if (depth < 0.0) {
      EXPECT_FALSE(share(a, b));
    }
    overlapping += depth > 0.0 ? 1 : 0;
  }
  EXPECT_GT(overlapping, 20);
  EXPECT_LT(overlapping, 180);
}

TEST(OrientedBox, DepthOfPoints) {
  OrientedBox box;
  box.T_atlas_box.translation() << 1.0, 0.0, 0.0;
  box.size << 2.0, 4.0, 6.0;
  EXPECT_DOUBLE_EQ(box.depth({2.0, 2.0, 3.0}), 1.0);
  EXPECT_DOUBLE_EQ(box.depth({1.25, 2.0, 3.0}), 0.25);
  EXPECT_DOUBLE_EQ(box.depth({-2.0, -4.0, 3.0}), -5.0);
  EXPECT_TRUE(box.bounds().min().isApprox(Eigen::Vector3d(1.0, 0.0, 0.0)));
}

TEST(BoxTree, FindsWhatAllPairsFind) {
  std::mt19937 random(5);
  for (const int count : {0, 1, 5, 300}) {
    std::vector<Eigen::AlignedBox3d> boxes;
    for (int n = 0; n < count; ++n) boxes.push_back(randomBox(random).bounds());
    const BoxTree tree(boxes);
    for (int ask = 0; ask < 20; ++ask) {
      const Eigen::AlignedBox3d near = randomBox(random).bounds();
      std::vector<std::size_t> wanted;
      for (std::size_t n = 0; n < boxes.size(); ++n) {
        if (boxes[n].exteriorDistance(near) <= 0.3) wanted.push_back(n);
      }
      EXPECT_EQ(tree.within(near, 0.3), wanted);
    }
  }
}

}  // namespace
}  // namespace ttsdf

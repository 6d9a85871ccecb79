#include "../../src/registration/scan_buffer.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace ttsdf {
namespace {

Eigen::Matrix3Xf randomPoints(int count, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  return Eigen::Matrix3Xf::NullaryExpr(3, count, [&] { return normal(random); });
}

Eigen::Vector3d point(const ScanBuffer& scan, int n) {
  return scan.centroid() + Eigen::Vector3d(scan.x()[n], scan.y()[n], scan.z()[n]);
}

TEST(ScanBuffer, KeepsEveryFinitePointOnce) {
  Eigen::Matrix3Xf points = randomPoints(100);
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  points(0, 3) = nan, points(1, 50) = inf, points(2, 99) = -inf, points(1, 7) = 1e30f;
  ScanBuffer scan;
  scan.assign(points, 1000);
  ASSERT_EQ(scan.size(), 96);
  std::vector<int> met(100, 0);
  for (int n = 0; n < scan.size(); ++n) {
    const Eigen::Vector3f p = point(scan, n).cast<float>();
    for (Eigen::Index m = 0; m < 100; ++m)
      met[static_cast<std::size_t>(m)] += (points.col(m) - p).norm() < 1e-5f ? 1 : 0;
  }
  for (std::size_t n = 0; n < met.size(); ++n)
    EXPECT_EQ(met[n], n == 3 || n == 7 || n == 50 || n == 99 ? 0 : 1) << n;
}

TEST(ScanBuffer, KnowsCentroidAndRadius) {
  const Eigen::Matrix3Xf points = randomPoints(500).colwise() + Eigen::Vector3f(10.0f, -20.0f, 5.0f);
  ScanBuffer scan;
  scan.assign(points, 1000);
  const Eigen::Vector3d mean = points.cast<double>().rowwise().mean();
  EXPECT_LT((scan.centroid() - mean).norm(), 1e-9);
  EXPECT_NEAR(scan.radius(),
              std::sqrt((points.cast<double>().colwise() - mean).colwise().squaredNorm().mean()), 1e-6);
}

TEST(ScanBuffer, SubSamplesEvenly) {
  // Points on a line: an even sub-sample leaves no gap.
  Eigen::Matrix3Xf points = Eigen::Matrix3Xf::Zero(3, 1000);
  for (int n = 0; n < 1000; ++n) points(0, n) = static_cast<float>(n);
  for (const int max_points : {7, 64, 100, 999, 1000, 5000}) {
    ScanBuffer scan;
    scan.assign(points, max_points);
    EXPECT_EQ(scan.size(), std::min(max_points, 1000));
    for (const int wanted : {scan.size() / 8, scan.size() / 4, scan.size() / 2, scan.size()}) {
      const int count = scan.prefix(wanted);
      EXPECT_GE(count, wanted);
      EXPECT_LE(count, scan.size());
      std::vector<double> x;
      for (int n = 0; n < count; ++n) x.push_back(point(scan, n).x());
      std::sort(x.begin(), x.end());
      for (std::size_t n = 1; n < x.size(); ++n) {
        EXPECT_LT(x[n] - x[n - 1], 2.0 * 1000.0 / count + 2.0) << max_points << ", prefix of " << count;
      }
    }
  }
}

TEST(ScanBuffer, TakesScansWithoutAnyPoint) {
  ScanBuffer scan;
  scan.assign(randomPoints(10), 5);
  scan.assign(Eigen::Matrix3Xf(3, 0), 100);
  EXPECT_EQ(scan.size(), 0);
  EXPECT_EQ(scan.radius(), 0.0);
  EXPECT_EQ(scan.prefix(10), 0);
  scan.assign(Eigen::Matrix3Xf::Constant(3, 20, std::numeric_limits<float>::quiet_NaN()), 100);
  EXPECT_EQ(scan.size(), 0);
}

}  // namespace
}  // namespace ttsdf

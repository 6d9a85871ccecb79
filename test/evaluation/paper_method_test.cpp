// The paper's Gauss-Newton on an analytic field, against an exact pose and a fit written out by hand.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "ttsdf_localization/evaluation/method.h"
#include "ttsdf_localization/field/dense_distance_field.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {
namespace {

constexpr double kVoxel = 0.02;

// Floor, two walls: the distance to the nearest of three planes meeting at the origin.
double corner(const Eigen::Vector3d& p) { return std::min({p.x(), p.y(), p.z()}); }

std::shared_ptr<const DistanceField> cornerField(Interpolation interpolation) {
  GridGeometry geometry;
  geometry.dims = {70, 70, 70};
  geometry.voxel_size = kVoxel;
  geometry.T_map_grid.translation().setConstant(-0.2);
  DenseTensor values(geometry.dims);
  for (int k = 0, n = 0; k < 70; ++k) {
    for (int j = 0; j < 70; ++j) {
      for (int i = 0; i < 70; ++i, ++n) {
        values.data()[n] =
            static_cast<float>(std::abs(corner(geometry.T_map_grid * (kVoxel * Eigen::Vector3d(i, j, k)))));
      }
    }
  }
  return std::make_shared<DenseDistanceField>(std::move(values), geometry, SupportMask{}, interpolation);
}

ScanPoints cornerScan(const Eigen::Isometry3d& T_map_sensor) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> along(0.15f, 0.9f);
  ScanPoints points(3, 900);
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    Eigen::Vector3f p(along(random), along(random), along(random));
    p[n % 3] = 0.0f;
    points.col(n) = T_map_sensor.inverse().cast<float>() * p;
  }
  return points;
}

Eigen::Isometry3d sensorPose() {
  Vector6d twist;
  twist << 0.3, -0.2, 0.5, 0.6, 0.5, 0.4;
  return expSe3(twist);
}

TEST(PaperMethod, EndsWithinAVoxelWhereItLooksAtTheNearestVoxel) {
  const auto method = makePaperMethod(cornerField(Interpolation::kNearest));
  const Eigen::Isometry3d truth = sensorPose();
  const Eigen::Isometry3d prior = Eigen::Translation3d(0.05, -0.04, 0.03) * truth;
  const Estimate estimate = method->estimate(cornerScan(truth), prior, std::nullopt);
  EXPECT_LT(poseError(truth, estimate.T_map_sensor).translation, kVoxel);
  EXPECT_LT(poseError(truth, estimate.T_map_sensor).rotation, 0.02);
  EXPECT_TRUE(estimate.accepted);
}

TEST(PaperMethod, WeighsEveryPointAlike) {
  // Ten times as many points on one wall, at another offset: the step of a single iteration is that of plain
  // least squares over all of them.
  const auto field = cornerField(Interpolation::kNearest);
  PaperMethodOptions options;
  options.max_iterations = 1;
  const Eigen::Isometry3d truth = sensorPose();
  const Eigen::Isometry3d prior = Eigen::Translation3d(0.03, 0.02, -0.02) * truth;
  const ScanPoints points = cornerScan(truth);
  const Eigen::Matrix3Xf moved = (prior.cast<float>() * points).eval();
  const FieldSamples samples = field->evaluate(moved);
  Eigen::MatrixXd J(points.cols(), 6);
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const Eigen::Vector3d x = moved.col(n).cast<double>(), g = samples.gradients.col(n).cast<double>();
    J.row(n) << x.cross(g).transpose(), g.transpose();
  }
  const Vector6d step = J.colPivHouseholderQr().solve(-samples.values.cast<double>());
  const Estimate estimate = makePaperMethod(field, options)->estimate(points, prior, std::nullopt);
  EXPECT_TRUE(estimate.T_map_sensor.isApprox(expSe3(step) * prior, 1e-6));
  EXPECT_EQ(estimate.reason, "max_iterations");
}

TEST(PaperMethod, RefusesAScanOutsideOfTheBox) {
  const auto method = makePaperMethod(cornerField(Interpolation::kNearest));
  const Eigen::Isometry3d prior = Eigen::Translation3d(50.0, 0.0, 0.0) * sensorPose();
  const Estimate estimate = method->estimate(cornerScan(sensorPose()), prior, std::nullopt);
  EXPECT_FALSE(estimate.accepted);
  EXPECT_EQ(estimate.reason, "outside_map");
}

}  // namespace
}  // namespace ttsdf

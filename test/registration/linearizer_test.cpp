#include "../../src/registration/solver/linearizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "analytic_world.h"

namespace ttsdf {
namespace {

/// A smooth function with a gradient longer than 1 in places, evaluated exactly; unknown and outside by
/// position.
class AnalyticField final : public DistanceField {
 public:
  static double value(const Eigen::Vector3d& p) {
    return 0.3 * std::sin(2.0 * p.x()) + 0.2 * p.y() * p.z() + 0.1 * p.z() * p.z() - 0.2;
  }
  static Eigen::Vector3d gradient(const Eigen::Vector3d& p) {
    return {0.6 * std::cos(2.0 * p.x()), 0.2 * p.z(), 0.2 * p.y() + 0.2 * p.z()};
  }
  static PointState state(const Eigen::Vector3d& p) {
    if (std::abs(p.x()) > 3.0) return PointState::kOutside;
    return p.y() > 2.5 ? PointState::kUnknown : PointState::kValid;
  }

  const GridGeometry& geometry() const override { return geometry_; }
  std::size_t memoryBytes() const override { return 0; }
  using DistanceField::evaluate;
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override {
    for (int n = 0; n < points.size; ++n) {
      const Eigen::Vector3d p(points.x[n], points.y[n], points.z[n]);
      const Eigen::Vector3d g = gradient(p);
      samples.state[n] = state(p);
      const bool inside = samples.state[n] != PointState::kOutside;
      samples.value[n] = inside ? static_cast<float>(value(p)) : 0.0f;
      samples.gradient_x[n] = inside ? static_cast<float>(g.x()) : 0.0f;
      samples.gradient_y[n] = inside ? static_cast<float>(g.y()) : 0.0f;
      samples.gradient_z[n] = inside ? static_cast<float>(g.z()) : 0.0f;
    }
  }

 private:
  GridGeometry geometry_;
};

const Eigen::Isometry3d kPose = expSe3((Vector6d() << 0.3, -0.5, 0.8, 0.2, -0.4, 0.6).finished());

Eigen::Matrix3Xf scanPoints(int count, float spread = 1.0f) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal(0.3f, spread);
  return Eigen::Matrix3Xf::NullaryExpr(3, count, [&] { return normal(random); });
}

ResidualModel plain() {
  ResidualModel model;
  model.robust = false;
  model.limit_gradient = false;
  return model;
}

double loss(double r, const ResidualModel& model) {
  return model.robust ? r * r / (r * r + model.scale * model.scale) : r * r;
}

/// Trust in a point of the sensor frame: a Kinect, where everything else is off by 1 cm.
double pointWeight(const Eigen::Vector3d& p) {
  const double sigma = 0.0005 + 0.001425 * p.squaredNorm();
  return 1e-4 / (1e-4 + sigma * sigma);
}

ScanBuffer kinectScan() {
  ScanBuffer scan;
  scan.setSensor(sensorModel("kinect"), 0.01);
  return scan;
}

/// Cost of the valid points in double, with the states of the unperturbed pose.
double cost(const Eigen::Matrix3Xf& points, const Eigen::Isometry3d& T, const ResidualModel& model) {
  double sum = 0.0;
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const Eigen::Vector3d p = points.col(n).cast<double>();
    if (AnalyticField::state(kPose * p) == PointState::kValid)
      sum += pointWeight(p) * loss(AnalyticField::value(T * p), model);
  }
  return sum;
}

/// Rows of the Jacobian by central differences of the residual over the retraction.
Vector6d numericRow(const Eigen::Vector3d& p, const Eigen::Vector3d& centroid) {
  constexpr double kStep = 1e-6;
  Vector6d row;
  for (int d = 0; d < 6; ++d) {
    const Vector6d xi = kStep * Vector6d::Unit(d);
    row[d] = (AnalyticField::value(retract(kPose, centroid, xi) * p) -
              AnalyticField::value(retract(kPose, centroid, -xi) * p)) /
             (2.0 * kStep);
  }
  return row;
}

TEST(Linearizer, JacobianEqualsNumericDifferentiation) {
  // With plain least squares on three points (one would sit on its own centroid), H is the sum of J J^T.
  const Eigen::Matrix3Xf points = scanPoints(3);
  ScanBuffer scan = kinectScan();
  scan.assign(points, 10);
  const NormalEquations e = linearize(AnalyticField(), scan, 3, kPose, plain());
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  for (int n = 0; n < 3; ++n) {
    const Eigen::Vector3d p = points.col(n).cast<double>();
    const Vector6d row = numericRow(p, scan.centroid());
    H += pointWeight(p) * row * row.transpose();
    g += pointWeight(p) * AnalyticField::value(kPose * p) * row;
  }
  EXPECT_LT((e.H - H).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT((e.g - g).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(Linearizer, GradientIsTheDerivativeOfTheCost) {
  const Eigen::Matrix3Xf points = scanPoints(1000);
  ScanBuffer scan = kinectScan();
  scan.assign(points, 1000);
  ResidualModel robust = plain();
  robust.robust = true;
  robust.scale = 0.2;
  for (const ResidualModel& model : {plain(), robust}) {
    const NormalEquations e = linearize(AnalyticField(), scan, scan.size(), kPose, model);
    EXPECT_NEAR(e.cost, cost(points, kPose, model), 1e-5 * e.cost);
    // d(r^2) = 2 r dr, and for Geman-McClure d(r^2 / (r^2 + s^2)) = 2 / s^2 w r dr.
    const double factor = model.robust ? 2.0 / (model.scale * model.scale) : 2.0;
    constexpr double kStep = 1e-5;
    for (int d = 0; d < 6; ++d) {
      const Vector6d xi = kStep * Vector6d::Unit(d);
      const double numeric = (cost(points, retract(kPose, scan.centroid(), xi), model) -
                              cost(points, retract(kPose, scan.centroid(), -xi), model)) /
                             (2.0 * kStep);
      EXPECT_NEAR(factor * e.g[d], numeric, 1e-4 * factor * e.g.cwiseAbs().maxCoeff()) << d;
    }
  }
}

TEST(Linearizer, SumsEqualBruteForceInDouble) {
  const Eigen::Matrix3Xf points = scanPoints(777, 1.5f);
  ScanBuffer scan = kinectScan();
  scan.assign(points, 1000);
  ResidualModel model;
  model.scale = 0.15;
  const NormalEquations e = linearize(AnalyticField(), scan, scan.size(), kPose, model);
  Matrix6d H = Matrix6d::Zero();
  double weight = 0.0, score = 0.0, squares = 0.0, inlier_squares = 0.0;
  int valid = 0, unknown = 0, outside = 0, inliers = 0;
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const Eigen::Vector3d x = kPose * points.col(n).cast<double>();
    const PointState state = AnalyticField::state(x);
    valid += state == PointState::kValid, unknown += state == PointState::kUnknown;
    outside += state == PointState::kOutside;
    if (state != PointState::kValid) continue;
    const double r = AnalyticField::value(x),
                 q = model.scale * model.scale / (r * r + model.scale * model.scale);
    Eigen::Vector3d gradient = AnalyticField::gradient(x);
    if (gradient.norm() > 1.0) gradient.normalize();
    Vector6d J;
    J << (x - kPose * scan.centroid()).cross(gradient), gradient;
    const double w = pointWeight(points.col(n).cast<double>()) * q * q;
    H += w * J * J.transpose();
    weight += w;
    score += r * r / (r * r + model.score_scale * model.score_scale);
    squares += r * r;
    if (std::abs(r) < model.inlier_distance) ++inliers, inlier_squares += r * r;
  }
  EXPECT_GT(unknown, 10);
  EXPECT_GT(outside, 10);
  EXPECT_EQ(e.valid, valid);
  EXPECT_EQ(e.unknown, unknown);
  EXPECT_EQ(e.outside, outside);
  EXPECT_EQ(e.inliers, inliers);
  EXPECT_EQ(e.points(), 777);
  EXPECT_LT((e.H - H).cwiseAbs().maxCoeff(), 1e-5 * H.cwiseAbs().maxCoeff());
  EXPECT_NEAR(e.weight, weight, 1e-5 * weight);
  EXPECT_NEAR(e.score, score, 1e-5 * score);
  EXPECT_NEAR(e.squares, squares, 1e-5 * squares);
  EXPECT_NEAR(e.inlier_squares, inlier_squares, 1e-4 * inlier_squares);
}

TEST(Linearizer, LimitsGradientsToUnitLength) {
  // A field of slope 3: where limited, a point tells no more than one in an exact distance field.
  GridGeometry geometry = test::roomGeometry();
  const auto steep = test::denseField([](const Eigen::Vector3d& p) { return 3.0 * p.x(); }, geometry);
  ScanBuffer scan = kinectScan();
  scan.assign(Eigen::Matrix3Xf::Random(3, 50).cwiseAbs(), 100);
  ResidualModel model = plain();
  const double free = linearize(*steep, scan, 50, Eigen::Isometry3d::Identity(), model).H(3, 3);
  model.limit_gradient = true;
  const double limited = linearize(*steep, scan, 50, Eigen::Isometry3d::Identity(), model).H(3, 3);
  EXPECT_NEAR(free / limited, 9.0, 1e-3);
  double trusted = 0.0;
  for (int n = 0; n < 50; ++n) trusted += scan.weight()[n];
  EXPECT_NEAR(limited, trusted, 0.01);
}

TEST(Linearizer, UsesThePrefixThatItIsGiven) {
  const Eigen::Matrix3Xf points = scanPoints(600);
  ScanBuffer scan = kinectScan();
  scan.assign(points, 1000);
  for (const int count : {0, 1, 15, 16, 17, 255, 256, 257, 600}) {
    EXPECT_EQ(linearize(AnalyticField(), scan, count, kPose, plain()).points(), count);
  }
}

TEST(Linearizer, RepeatsItselfToTheBit) {
  ScanBuffer scan = kinectScan();
  scan.assign(scanPoints(1000), 1000);
  const NormalEquations a = linearize(AnalyticField(), scan, 1000, kPose, {}),
                        b = linearize(AnalyticField(), scan, 1000, kPose, {});
  EXPECT_EQ(a.H, b.H);
  EXPECT_EQ(a.g, b.g);
  EXPECT_EQ(a.cost, b.cost);
}

TEST(Linearizer, SpreadIsTheScaledMedianOfTheResidualsThatSaySomething) {
  const AnalyticField field;
  const Eigen::Matrix3Xf all = scanPoints(901);
  ScanBuffer scan = kinectScan();
  scan.assign(all, 1000);
  std::vector<double> sizes;
  for (Eigen::Index n = 0; n < all.cols(); ++n) {
    const Eigen::Vector3d p = kPose * all.col(n).cast<double>();
    if (AnalyticField::state(p) == PointState::kValid) sizes.push_back(std::abs(AnalyticField::value(p)));
  }
  ASSERT_GT(sizes.size(), 300u);
  std::sort(sizes.begin(), sizes.end());
  // 0.6745 is the upper quartile of the normal distribution.
  EXPECT_NEAR(residualSpread(field, scan, scan.size(), kPose, plain()), sizes[sizes.size() / 2] / 0.6745,
              1e-4);
  Eigen::Isometry3d away = kPose;
  away.translation().x() += 100.0;
  EXPECT_EQ(residualSpread(field, scan, scan.size(), away, plain()), 0.0);
}

TEST(Retract, MovesAboutTheCentroid) {
  const Eigen::Vector3d centroid(1.0, 2.0, 3.0), p(0.3, -0.2, 0.9);
  const Vector6d xi = (Vector6d() << 0.1, -0.2, 0.3, 0.4, 0.5, -0.6).finished();
  const Eigen::Vector3d c = kPose * centroid;
  const Eigen::Vector3d truth = c + expSe3(xi) * (kPose * p - c);
  EXPECT_LT((retract(kPose, centroid, xi) * p - truth).norm(), 1e-12);
  EXPECT_LT((retract(kPose, centroid, Vector6d::Zero()).matrix() - kPose.matrix()).norm(), 1e-14);
}

TEST(Retract, StaysARotationOverManySteps) {
  Eigen::Isometry3d T = kPose;
  const Vector6d xi = (Vector6d() << 1e-2, -2e-2, 3e-2, 1e-3, 0.0, 0.0).finished();
  for (int step = 0; step < 100000; ++step) T = retract(T, Eigen::Vector3d::Zero(), xi);
  const Eigen::Matrix3d R = T.linear();
  EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-13);
}

/// By the definition: the ray from the sensor runs along the gradient, or against it too little deep inside.
bool isBehind(const Eigen::Vector3d& p_sensor) {
  const Eigen::Vector3d p = kPose * p_sensor, g = AnalyticField::gradient(p);
  const double cosine = g.dot((p - kPose.translation()).normalized());
  return cosine > (AnalyticField::value(p) < -0.05 ? -0.3 : 0.3);
}

TEST(Linearizer, PointsBehindSurfacesCountAsIfTheyWereNotThere) {
  const AnalyticField field;
  const Eigen::Matrix3Xf all = scanPoints(900);
  ResidualModel model;
  model.check_facing = true;
  ScanBuffer scan = kinectScan();
  scan.assign(all, 1000);
  const NormalEquations e = linearize(field, scan, scan.size(), kPose, model);

  int behind = 0, valid = 0, inliers = 0;
  double score = 0.0, squares = 0.0;
  for (Eigen::Index n = 0; n < all.cols(); ++n) {
    const Eigen::Vector3d p_sensor = all.col(n).cast<double>(), p = kPose * p_sensor;
    if (AnalyticField::state(p) != PointState::kValid) continue;
    if (isBehind(p_sensor)) {
      ++behind;
      continue;
    }
    const double r = AnalyticField::value(p);
    ++valid;
    inliers += std::abs(r) < model.inlier_distance ? 1 : 0;
    squares += r * r;
    score += r * r / (r * r + model.score_scale * model.score_scale);
  }
  ASSERT_GT(behind, 100);
  ASSERT_GT(valid, 100);
  EXPECT_EQ(e.behind, behind);
  EXPECT_EQ(e.valid, valid);
  EXPECT_EQ(e.inliers, inliers);
  EXPECT_EQ(e.points(), 900);
  EXPECT_NEAR(e.squares, squares, 1e-4 * squares);
  EXPECT_NEAR(e.score, score, 1e-4 * score);

  model.check_facing = false;
  EXPECT_EQ(linearize(field, scan, scan.size(), kPose, model).behind, 0);
}

}  // namespace
}  // namespace ttsdf

#include "ttsdf_localization/surface/manhattan_frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

namespace ttsdf {
namespace {

constexpr double kDegree = M_PI / 180.0;

class Directions {
 public:
  explicit Directions(unsigned seed) : generator_(seed) {}
  /// `count` normals around a direction, each component disturbed by `noise`.
  void add(const Eigen::Vector3d& direction, int count, double noise) {
    for (int n = 0; n < count; ++n)
      add(direction + noise * Eigen::Vector3d(normal_(generator_), normal_(generator_), normal_(generator_)));
  }
  void addClutter(int count) {
    for (int n = 0; n < count; ++n)
      add(Eigen::Vector3d(normal_(generator_), normal_(generator_), normal_(generator_)));
  }
  ManhattanFrame frame() const {
    Eigen::Matrix3Xf normals(3, static_cast<Eigen::Index>(all_.size()));
    for (std::size_t n = 0; n < all_.size(); ++n)
      normals.col(static_cast<Eigen::Index>(n)) = all_[n].cast<float>();
    return manhattanFrame(normals, Eigen::VectorXf::Ones(normals.cols()));
  }

 private:
  void add(const Eigen::Vector3d& n) { all_.push_back(n.normalized()); }
  std::mt19937 generator_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector3d> all_;
};

/// Smallest angle between two frames whose axes may be swapped and turned round.
double angleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  const Eigen::Matrix3d cosines = (a.transpose() * b).cwiseAbs();
  double worst = 0.0;
  for (int c = 0; c < 3; ++c) worst = std::max(worst, std::acos(std::min(1.0, cosines.col(c).maxCoeff())));
  return worst;
}

Eigen::Matrix3d turned(double yaw, double pitch, double roll) {
  return (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

TEST(ManhattanFrame, FindsTurnedRooms) {
  for (const auto& [yaw, pitch, roll] :
       {std::array{0.0, 0.0, 0.0}, {0.3, 0.0, 0.0}, {0.785, 0.0, 0.0}, {-0.6, 0.2, 0.1}, {0.1, -0.4, 0.5}}) {
    const Eigen::Matrix3d R = turned(yaw, pitch, roll);
    Directions room(7);
    room.add(R.col(0), 3000, 0.1);
    room.add(-R.col(0), 2000, 0.1);
    room.add(R.col(1), 2500, 0.1);
    room.add(R.col(2), 5000, 0.1);
    room.addClutter(6000);
    const ManhattanFrame frame = room.frame();
    EXPECT_LT(angleBetween(frame.R_map_frame, R) / kDegree, 0.3) << yaw << ' ' << pitch << ' ' << roll;
    EXPECT_GT(frame.share, 0.4);
    EXPECT_NEAR(frame.R_map_frame.determinant(), 1.0, 1e-9);
  }
}

TEST(ManhattanFrame, IsTheOneTurnedLeast) {
  const Eigen::Matrix3d R = turned(1.4, 0.0, 0.0);  // -0.17 rad is the same frame
  Directions room(3);
  for (int axis = 0; axis < 3; ++axis) room.add(R.col(axis), 1000, 0.02);
  EXPECT_NEAR(Eigen::AngleAxisd(room.frame().R_map_frame).angle(), M_PI / 2 - 1.4, 0.01);
}

TEST(ManhattanFrame, OneDirectionFixesOneAxis) {
  const Eigen::Vector3d up = Eigen::Vector3d(0.1, -0.2, 1.0).normalized();
  Directions floor(5);
  floor.add(up, 5000, 0.02);
  const ManhattanFrame frame = floor.frame();
  EXPECT_LT(std::acos(frame.R_map_frame.col(2).dot(up)) / kDegree, 0.1);
  EXPECT_NEAR(Eigen::AngleAxisd(frame.R_map_frame).angle(), std::acos(up.z()), 0.02);
}

TEST(ManhattanFrame, LeavesPlacesWithoutPlanesAlone) {
  Directions ball(11);
  ball.addClutter(20000);
  const ManhattanFrame frame = ball.frame();
  EXPECT_TRUE(frame.R_map_frame.isIdentity());
  EXPECT_LT(frame.share, 0.25);
}

TEST(ManhattanFrame, RefusesNothing) {
  EXPECT_THROW(manhattanFrame(Eigen::Matrix3Xf(3, 0), Eigen::VectorXf(0)), std::invalid_argument);
  EXPECT_THROW(manhattanFrame(Eigen::Matrix3Xf::Ones(3, 2), Eigen::VectorXf::Ones(3)), std::invalid_argument);
  EXPECT_THROW(manhattanFrame(Eigen::Matrix3Xf::Ones(3, 2), Eigen::VectorXf::Zero(2)), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf

#include "ros/messages/conversions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "ttsdf_localization/compression/map_writer.h"
#include "ttsdf_localization/localization/pose_covariance.h"

namespace ttsdf {
namespace {

Eigen::Isometry3d somePose() {
  Vector6d xi;
  xi << 0.3, -0.7, 1.9, 1.0, -2.0, 0.5;
  return expSe3(xi);
}

TEST(Conversions, PoseAndTransformGoThereAndBack) {
  EXPECT_TRUE(fromMessage(toPoseMessage(somePose())).isApprox(somePose(), 1e-12));
  EXPECT_TRUE(fromMessage(toTransformMessage(somePose())).isApprox(somePose(), 1e-12));
}

TEST(Conversions, AQuaternionAlmostOfUnitLengthIsNormalised) {
  geometry_msgs::Pose pose = toPoseMessage(somePose());
  pose.orientation.w *= 1.002;
  const Eigen::Matrix3d R = fromMessage(pose).linear();
  EXPECT_TRUE((R * R.transpose()).isIdentity(1e-12));
}

TEST(Conversions, RefusesNanAndZeroQuaternion) {
  geometry_msgs::Pose pose = toPoseMessage(somePose());
  pose.position.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fromMessage(pose), std::invalid_argument);
  pose = toPoseMessage(somePose());
  pose.orientation.x = std::numeric_limits<double>::infinity();
  EXPECT_THROW(fromMessage(pose), std::invalid_argument);
  pose = geometry_msgs::Pose();  // as a message is made: all zero
  EXPECT_THROW(fromMessage(pose), std::invalid_argument);
}

// ROS: row-major, x y z before roll pitch yaw. The library: rotation first.
TEST(Conversions, CovarianceHasTranslationFirst) {
  Vector6d variances;
  variances << 4.0, 5.0, 6.0, 1.0, 2.0, 3.0;
  Matrix6d covariance = variances.asDiagonal();
  covariance(2, 3) = covariance(3, 2) = 0.25;  // yaw against x
  const boost::array<double, 36> message = toCovarianceMessage(covariance);
  for (std::size_t n = 0; n < 6; ++n) EXPECT_EQ(message[7 * n], static_cast<double>(n + 1));
  EXPECT_EQ(message[0 * 6 + 5], 0.25);
  EXPECT_EQ(message[5 * 6 + 0], 0.25);
  EXPECT_EQ(fromCovarianceMessage(message), covariance);
}

TEST(Conversions, RefusesWhatIsNoCovariance) {
  boost::array<double, 36> message;
  message.fill(0.0);
  EXPECT_EQ(fromCovarianceMessage(message), Matrix6d(Matrix6d::Zero()));
  message[0] = -1.0;
  EXPECT_THROW(fromCovarianceMessage(message), std::invalid_argument);
  message[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fromCovarianceMessage(message), std::invalid_argument);
  message[0] = 1.0;
  message[1] = 0.5;
  EXPECT_THROW(fromCovarianceMessage(message), std::invalid_argument);
}

TEST(Conversions, StripsOneLeadingSlash) {
  EXPECT_EQ(withoutLeadingSlash("/map"), "map");
  EXPECT_EQ(withoutLeadingSlash("map"), "map");
  EXPECT_EQ(withoutLeadingSlash(""), "");
}

TtSdfMap smallMap() {
  TtSdfMap map;
  const Dims dims(5, 4, 3);
  map.train = TensorTrain({{0, 1, 2}}, Eigen::MatrixXf::Random(5, 2), Eigen::MatrixXf::Random(2, 4 * 2),
                          Eigen::MatrixXf::Random(2, 3));
  map.geometry.dims = dims;
  map.geometry.voxel_size = 0.05;
  return map;
}

TEST(Conversions, MapMessageCarriesTheFile) {
  const TtSdfMap map = smallMap();
  const std::vector<std::uint8_t> bytes = serialize(map);
  const ttsdf_localization::TtSdfMap message = toMapMessage(bytes, "map");
  EXPECT_EQ(message.data, bytes);
  EXPECT_EQ(message.file_bytes, bytes.size());
  EXPECT_EQ(message.map_id, fileInfo(bytes.data(), bytes.size()).map_id);
  EXPECT_EQ(message.dims[0], 5u);
  EXPECT_EQ(message.dims[2], 3u);
  EXPECT_EQ(message.ranks[1], 2u);
  EXPECT_EQ(message.voxel_size, 0.05);
  EXPECT_TRUE(fromMapMessage(message).train.middle().isApprox(map.train.middle()));
}

TEST(Conversions, MapMessageWithBadBytesIsRefused) {
  ttsdf_localization::TtSdfMap message = toMapMessage(serialize(smallMap()), "map");
  message.data[message.data.size() / 2] ^= 1;
  EXPECT_THROW(fromMapMessage(message), MapFormatError);
  message.data.clear();
  EXPECT_THROW(fromMapMessage(message), MapFormatError);
}

}  // namespace
}  // namespace ttsdf

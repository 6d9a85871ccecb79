#include "ros/poses/pose_store.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <string>

#include "ttsdf_localization/localization/pose_covariance.h"

namespace ttsdf {
namespace {

class PoseStore : public ::testing::Test {
 protected:
  ~PoseStore() override { std::remove(path_.c_str()); }
  const std::string path_ = ::testing::TempDir() + "ttsdf_pose_store_test.txt";
};

TEST_F(PoseStore, GivesBackWhatWasSaved) {
  PoseGuess pose;
  Vector6d xi;
  xi << 0.1, 2.0, -0.3, 4.0, 5.0, 6.0;
  pose.T_map_base = expSe3(xi);
  pose.covariance = isotropicCovariance(0.01, 0.02);
  savePose(path_, "map", pose);
  const auto loaded = loadPose(path_, "map");
  ASSERT_TRUE(loaded);
  EXPECT_TRUE(loaded->T_map_base.isApprox(pose.T_map_base, 1e-12));
  EXPECT_TRUE(loaded->covariance.isApprox(pose.covariance, 1e-12));
  EXPECT_FALSE(loaded->T_odom_base.has_value());  // the odometry starts anew
}

TEST_F(PoseStore, HasNothingAtTheFirstStart) { EXPECT_FALSE(loadPose(path_, "map")); }

TEST_F(PoseStore, RefusesOtherFilesAndOtherFrames) {
  savePose(path_, "map", PoseGuess());
  EXPECT_THROW(loadPose(path_, "world"), std::runtime_error);
  std::ofstream(path_) << "something else";
  EXPECT_THROW(loadPose(path_, "map"), std::runtime_error);
  std::ofstream(path_) << "ttsdf_localization_pose 1\nmap\n1 0 0";
  EXPECT_THROW(loadPose(path_, "map"), std::runtime_error);
}

}  // namespace
}  // namespace ttsdf

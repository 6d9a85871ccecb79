// PCL's interface around a map: the ten lines that a user of pcl::Registration writes.

#include "ttsdf_localization/pcl/map_registration.h"

#include <gtest/gtest.h>
#include <pcl/point_types.h>

#include "../registration/analytic_world.h"
#include "ttsdf_localization/compression/tt_svd.h"

namespace ttsdf {
namespace {

TEST(MapRegistration, IsUsedAsAnyRegistrationOfPcl) {
  TtSdfMap map;
  map.geometry = test::roomGeometry();
  TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = 40;
  map.train = ttSvd(test::sampled(test::furnishedRoom, map.geometry), options).train;
  map.truncation = 0.15;
  Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  truth.translation() << 1.3, 2.0, 1.4;
  truth.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 0.3).normalized()).toRotationMatrix();
  pcl::PointCloud<pcl::PointXYZ>::Ptr scan(new pcl::PointCloud<pcl::PointXYZ>);
  const ScanPoints points = test::castRays(test::furnishedRoom, truth, test::directions(1500));
  for (Eigen::Index n = 0; n < points.cols(); ++n)
    scan->push_back({points(0, n), points(1, n), points(2, n)});

  MapRegistration<pcl::PointXYZ> registration;
  registration.setInputTarget(map);
  registration.setInputSource(scan);
  Eigen::Matrix4f guess = truth.matrix().cast<float>();
  guess(0, 3) += 0.1F;
  pcl::PointCloud<pcl::PointXYZ> aligned;
  registration.align(aligned, guess);

  EXPECT_TRUE(registration.hasConverged());
  EXPECT_LT(
      (registration.getFinalTransformation().block<3, 1>(0, 3) - truth.translation().cast<float>()).norm(),
      0.01F);
  EXPECT_LT(registration.getFitnessScore(), 1e-4);
  EXPECT_EQ(aligned.size(), scan->size());
  EXPECT_LT((aligned[7].getVector3fMap() - (truth * (*scan)[7].getVector3fMap().cast<double>()).cast<float>())
                .norm(),
            0.02F);
}

}  // namespace
}  // namespace ttsdf

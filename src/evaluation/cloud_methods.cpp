// PCL's registration algorithms behind the Method interface. The map side (trees, normals, covariances, NDT
// cells) is prepared once; everything that depends on the scan is done, and timed, per scan.

#include <pcl/features/normal_3d.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/ndt.h>
#include <pcl/registration/transformation_estimation_point_to_plane_lls.h>

#include <stdexcept>

#include "ttsdf_localization/evaluation/method.h"

namespace ttsdf {

namespace {

using Point = pcl::PointXYZ;
using Cloud = pcl::PointCloud<Point>;

template <class PointT>
typename pcl::PointCloud<PointT>::Ptr toCloud(const Eigen::Matrix3Xf& points) {
  typename pcl::PointCloud<PointT>::Ptr cloud(new pcl::PointCloud<PointT>);
  cloud->reserve(static_cast<std::size_t>(points.cols()));
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    if (!points.col(n).allFinite()) continue;
    PointT point{};
    point.getVector3fMap() = points.col(n);
    cloud->push_back(point);
  }
  return cloud;
}

pcl::PointCloud<pcl::PointNormal>::Ptr withNormals(const Eigen::Matrix3Xf& points, int neighbours) {
  auto cloud = toCloud<pcl::PointNormal>(points);
  pcl::NormalEstimation<pcl::PointNormal, pcl::PointNormal> estimation;
  estimation.setInputCloud(cloud);
  estimation.setKSearch(neighbours);
  pcl::PointCloud<pcl::PointNormal> normals;
  estimation.compute(normals);
  for (std::size_t n = 0; n < cloud->size(); ++n) {
    (*cloud)[n].getNormalVector3fMap() = normals[n].getNormalVector3fMap();
  }
  return cloud;
}

// A pose with the rotation cleaned: PCL works in float.
Eigen::Isometry3d toPose(const Eigen::Matrix4f& matrix) {
  return orthonormalized(matrix.cast<double>(), 1.0);
}

template <class PointT>
class PclMethod final : public Method {
 public:
  using Algorithm = pcl::Registration<PointT, PointT>;
  PclMethod(std::shared_ptr<Algorithm> algorithm, const typename pcl::PointCloud<PointT>::Ptr& map)
      : algorithm_(std::move(algorithm)), map_points_(map->size()) {
    algorithm_->setInputTarget(map);
  }

  Estimate estimate(const ScanPoints& points, const Eigen::Isometry3d& T_map_prior,
                    const std::optional<Eigen::Vector3d>&) override {
    const auto scan = toCloud<PointT>(points);
    if (scan->size() < kMinPoints) return {T_map_prior, false, 0, "too_few_points"};
    algorithm_->setInputSource(scan);
    pcl::PointCloud<PointT> aligned;
    try {
      algorithm_->align(aligned, T_map_prior.matrix().cast<float>());
      const bool converged = algorithm_->hasConverged();
      return {toPose(algorithm_->getFinalTransformation()), converged, 0,
              converged ? "converged" : "not_converged"};
    } catch (const std::exception& error) {  // PCL throws for singular systems; a NaN pose fails in toPose
      return {T_map_prior, false, 0, "degenerate"};
    }
  }
  std::size_t paperBytes() const override { return cloudPaperBytes(map_points_); }

 private:
  static constexpr std::size_t kMinPoints = 20;
  std::shared_ptr<Algorithm> algorithm_;
  std::size_t map_points_;
};

template <class PointT>
void configure(pcl::Registration<PointT, PointT>& algorithm, const CloudMethodOptions& options) {
  algorithm.setMaxCorrespondenceDistance(options.max_correspondence_distance);
  algorithm.setMaximumIterations(options.max_iterations);
  algorithm.setTransformationEpsilon(options.epsilon * options.epsilon);  // PCL compares squares
}

}  // namespace

const OptionTable<CloudMethodOptions>& cloudMethodOptionTable() {
  static const OptionTable<CloudMethodOptions> kTable = [] {
    using O = CloudMethodOptions;
    OptionTable<O> table;
    table
        .add("max_correspondence_distance", &O::max_correspondence_distance, 1e-3, 100.0, "m",
             "Pairs further apart are left out (ICP, GICP).")
        .add("max_iterations", &O::max_iterations, 1, 10000, "", "Iterations at most.")
        .add("epsilon", &O::epsilon, 1e-12, 1.0, "", "Change of the transform below which the methods stop.")
        .add("normal_neighbours", &O::normal_neighbours, 3, 1000, "", "Neighbours of plane fits.")
        .add("ndt_resolution", &O::ndt_resolution, 0.01, 100.0, "m",
             "Cell of the normal distributions transform.")
        .add("ndt_step", &O::ndt_step, 1e-4, 10.0, "m", "Largest step of its line search.")
        .add("feature_cell", &O::feature_cell, 1e-4, 10.0, "m",
             "Scan's thinning before FPFH; twice it is the radius of normals, five times that of features.")
        .add("ransac_iterations", &O::ransac_iterations, 1, 100000000, "",
             "Poses tried at the most by sample consensus.");
    return table;
  }();
  return kTable;
}

std::unique_ptr<Method> makeCloudMethod(const std::string& kind, const Eigen::Matrix3Xf& map_cloud,
                                        const CloudMethodOptions& options) {
  if (map_cloud.cols() == 0) throw std::invalid_argument("map cloud: got no points, wanted at least one");
  if (kind == "icp") {
    auto icp = std::make_shared<pcl::IterativeClosestPoint<Point, Point>>();
    configure(*icp, options);
    return std::make_unique<PclMethod<Point>>(icp, toCloud<Point>(map_cloud));
  }
  if (kind == "icp_plane") {
    auto icp = std::make_shared<pcl::IterativeClosestPoint<pcl::PointNormal, pcl::PointNormal>>();
    using PointToPlane =
        pcl::registration::TransformationEstimationPointToPlaneLLS<pcl::PointNormal, pcl::PointNormal>;
    icp->setTransformationEstimation(PointToPlane::Ptr(new PointToPlane));
    configure(*icp, options);
    return std::make_unique<PclMethod<pcl::PointNormal>>(icp,
                                                         withNormals(map_cloud, options.normal_neighbours));
  }
  if (kind == "gicp") {
    auto gicp = std::make_shared<pcl::GeneralizedIterativeClosestPoint<Point, Point>>();
    configure(*gicp, options);
    gicp->setTransformationEpsilon(options.epsilon);
    gicp->setRotationEpsilon(options.epsilon);
    gicp->setCorrespondenceRandomness(options.normal_neighbours);
    return std::make_unique<PclMethod<Point>>(gicp, toCloud<Point>(map_cloud));
  }
  if (kind == "ndt") {
    auto ndt = std::make_shared<pcl::NormalDistributionsTransform<Point, Point>>();
    configure(*ndt, options);
    ndt->setTransformationEpsilon(options.epsilon);
    ndt->setResolution(static_cast<float>(options.ndt_resolution));
    ndt->setStepSize(options.ndt_step);
    return std::make_unique<PclMethod<Point>>(ndt, toCloud<Point>(map_cloud));
  }
  throw std::invalid_argument("point cloud method: got '" + kind + "', wanted icp, icp_plane, gicp or ndt");
}

}  // namespace ttsdf

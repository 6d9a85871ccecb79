// Open3D's registration, which the paper ran, behind the Method interface: ICP to points and to planes, and
// Fast Global Registration and sample consensus over FPFH descriptors. Compiled where Open3D is installed.

#include <open3d/geometry/KDTreeSearchParam.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/pipelines/registration/FastGlobalRegistration.h>
#include <open3d/pipelines/registration/Feature.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/pipelines/registration/TransformationEstimation.h>

#include <stdexcept>

#include "ttsdf_localization/evaluation/method.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

namespace {

namespace o3d = open3d::pipelines::registration;
using Cloud = open3d::geometry::PointCloud;
using open3d::geometry::KDTreeSearchParamHybrid;

constexpr std::size_t kMinPoints = 20;

Cloud toCloud(const Eigen::Matrix3Xf& points) {
  Cloud cloud;
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    if (points.col(n).allFinite()) cloud.points_.emplace_back(points.col(n).cast<double>());
  }
  return cloud;
}

class Icp final : public Method {
 public:
  Icp(const MapCloud& map, const CloudMethodOptions& options, bool to_planes)
      : map_(toCloud(map.points)), options_(options), to_planes_(to_planes) {
    if (to_planes_) {
      map_.EstimateNormals(open3d::geometry::KDTreeSearchParamKNN(options_.normal_neighbours));
    }
  }

  Estimate estimate(const ScanPoints& points, const Eigen::Isometry3d& T_map_prior,
                    const std::optional<Eigen::Vector3d>&) override {
    const Cloud scan = toCloud(points);
    if (scan.points_.size() < kMinPoints) return {T_map_prior, false, 0, "too_few_points"};
    const o3d::ICPConvergenceCriteria criteria(1e-7, 1e-7, options_.max_iterations);
    const Eigen::Matrix4d start = T_map_prior.matrix();
    const double reach = options_.max_correspondence_distance;
    const auto result = to_planes_
                            ? o3d::RegistrationICP(scan, map_, reach, start,
                                                   o3d::TransformationEstimationPointToPlane(), criteria)
                            : o3d::RegistrationICP(scan, map_, reach, start,
                                                   o3d::TransformationEstimationPointToPoint(), criteria);
    if (!result.transformation_.allFinite()) return {T_map_prior, false, 0, "degenerate"};
    return {orthonormalized(result.transformation_, 1.0), result.fitness_ > 0.0, 0, "converged"};
  }
  std::size_t paperBytes() const override { return cloudPaperBytes(map_.points_.size()); }

 private:
  Cloud map_;
  CloudMethodOptions options_;
  bool to_planes_;
};

struct Described {
  Cloud cloud;
  o3d::Feature features;
};

// Normals over twice the cell and towards the sensor, descriptors over five times the cell.
Described describe(const MapCloud& points, double cell) {
  Described result{toCloud(points.points), {}};
  result.cloud.EstimateNormals(KDTreeSearchParamHybrid(2.0 * cell, 30));
  for (std::size_t n = 0; n < result.cloud.points_.size(); ++n) {
    auto& normal = result.cloud.normals_[n];
    const Eigen::Vector3f towards = points.towards_sensor.col(static_cast<Eigen::Index>(n));
    if (normal.dot(towards.cast<double>()) < 0.0) normal = -normal;
  }
  result.features = *o3d::ComputeFPFHFeature(result.cloud, KDTreeSearchParamHybrid(5.0 * cell, 100));
  return result;
}

class FeatureMethod final : public Method {
 public:
  FeatureMethod(const MapCloud& map, const CloudMethodOptions& options, bool fast_global)
      : options_(options), map_(describe(map, options.feature_cell)), fast_global_(fast_global) {}

  Estimate estimate(const ScanPoints& points, const Eigen::Isometry3d& T_map_prior,
                    const std::optional<Eigen::Vector3d>&) override {
    MapCloud thin;
    thin.points = thinned(points, options_.feature_cell);
    thin.towards_sensor = -thin.points;  // the sensor is the origin
    const auto count = static_cast<std::size_t>(thin.points.cols());
    if (count < kMinPoints) return {T_map_prior, false, 0, "too_few_points"};
    const Described scan = describe(thin, options_.feature_cell);
    const auto result = fast_global_ ? fastGlobal(scan) : sampleConsensus(scan);
    if (!result.transformation_.allFinite() || result.fitness_ <= 0.0)
      return {T_map_prior, false, 0, "no_match"};
    return {orthonormalized(result.transformation_, 1.0), true, 0, "converged"};
  }
  std::size_t paperBytes() const override {
    return cloudPaperBytes(map_.cloud.points_.size()) +
           featurePaperBytes(map_.features.Num(), map_.features.Dimension());
  }

 private:
  o3d::RegistrationResult fastGlobal(const Described& scan) const {
    o3d::FastGlobalRegistrationOption option;
    option.maximum_correspondence_distance_ = options_.feature_cell;
    return o3d::FastGlobalRegistrationBasedOnFeatureMatching(scan.cloud, map_.cloud, scan.features,
                                                             map_.features, option);
  }
  o3d::RegistrationResult sampleConsensus(const Described& scan) const {
    const double reach = 1.5 * options_.feature_cell;
    const o3d::CorrespondenceCheckerBasedOnEdgeLength edges(0.9);
    const o3d::CorrespondenceCheckerBasedOnDistance distance(reach);
    return o3d::RegistrationRANSACBasedOnFeatureMatching(
        scan.cloud, map_.cloud, scan.features, map_.features, true, reach,
        o3d::TransformationEstimationPointToPoint(false), 3, {edges, distance},
        o3d::RANSACConvergenceCriteria(options_.ransac_iterations, 0.999));
  }

  CloudMethodOptions options_;
  Described map_;
  bool fast_global_;
};

}  // namespace

bool hasOpen3d() { return true; }

std::unique_ptr<Method> makeOpen3dMethod(const std::string& kind, const MapCloud& map,
                                         const CloudMethodOptions& options) {
  if (map.points.cols() == 0) throw std::invalid_argument("map cloud: got no points, wanted at least one");
  if (kind == "open3d_icp" || kind == "open3d_icp_plane") {
    return std::make_unique<Icp>(map, options, kind == "open3d_icp_plane");
  }
  if (kind == "fgr" || kind == "ransac") return std::make_unique<FeatureMethod>(map, options, kind == "fgr");
  throw std::invalid_argument("Open3D method: got '" + kind +
                              "', wanted open3d_icp, open3d_icp_plane, fgr or ransac");
}

}  // namespace ttsdf

// Registration without a prior from FPFH descriptors (Rusu et al. 2009, PCL): sample consensus with
// pre-rejection (Buch et al. 2013, PCL) and Fast Global Registration. Descriptors of the map are computed
// once; those of the scan are part of every call, and timed.

#include <pcl/features/fpfh.h>
#include <pcl/features/normal_3d.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>
#include <pcl/registration/sample_consensus_prerejective.h>

#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "ttsdf_localization/evaluation/method.h"

namespace ttsdf {

namespace {

using Cloud = pcl::PointCloud<pcl::PointNormal>;
using Feature = pcl::FPFHSignature33;
using Features = pcl::PointCloud<Feature>;
using Tree = pcl::KdTreeFLANN<Feature>;

constexpr std::size_t kMinFeatures = 20;

struct Described {
  Cloud::Ptr cloud{new Cloud};
  Features::Ptr features{new Features};
};

// Normals over twice the cell, towards the sensor; points without a normal are left out.
Cloud::Ptr oriented(const MapCloud& points, double cell) {
  Cloud::Ptr cloud(new Cloud);
  for (Eigen::Index n = 0; n < points.points.cols(); ++n) {
    pcl::PointNormal point;
    point.getVector3fMap() = points.points.col(n);
    cloud->push_back(point);
  }
  pcl::NormalEstimation<pcl::PointNormal, pcl::PointNormal> estimation;
  estimation.setInputCloud(cloud);
  estimation.setRadiusSearch(2.0 * cell);
  Cloud normals;
  estimation.compute(normals);
  Cloud::Ptr result(new Cloud);
  for (std::size_t n = 0; n < cloud->size(); ++n) {
    const Eigen::Vector3f normal = normals[n].getNormalVector3fMap();
    if (!normal.allFinite()) continue;
    const bool away = normal.dot(points.towards_sensor.col(static_cast<Eigen::Index>(n))) < 0.0f;
    result->push_back((*cloud)[n]);
    result->back().getNormalVector3fMap() = away ? Eigen::Vector3f(-normal) : normal;
  }
  return result;
}

Described describe(const MapCloud& points, double cell) {
  Described result;
  const auto cloud = oriented(points, cell);
  if (cloud->empty()) return result;
  pcl::FPFHEstimation<pcl::PointNormal, pcl::PointNormal, Feature> estimation;
  estimation.setInputCloud(cloud);
  estimation.setInputNormals(cloud);
  estimation.setRadiusSearch(5.0 * cell);
  Features features;
  estimation.compute(features);
  for (std::size_t n = 0; n < features.size(); ++n) {
    if (!std::isfinite(features[n].histogram[0])) continue;
    result.cloud->push_back((*cloud)[n]);
    result.features->push_back(features[n]);
  }
  return result;
}

Described describeScan(const ScanPoints& points, double cell) {
  MapCloud scan;
  scan.points = thinned(points, cell);
  scan.towards_sensor = -scan.points;  // the sensor is the origin
  return describe(scan, cell);
}

Eigen::Matrix3Xf positions(const Cloud& cloud) {
  Eigen::Matrix3Xf points(3, static_cast<Eigen::Index>(cloud.size()));
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    points.col(n) = cloud[static_cast<std::size_t>(n)].getVector3fMap();
  }
  return points;
}

int nearest(const Tree& tree, const Feature& feature) {
  std::vector<int> index(1);
  std::vector<float> squared_distance(1);
  return tree.nearestKSearch(feature, 1, index, squared_distance) > 0 ? index[0] : -1;
}

// Matches that are each other's nearest. Map features that no scan feature chose are not asked back.
std::vector<Correspondence> match(const Features& scan, const Features& map, const Tree& map_tree) {
  Tree scan_tree;
  scan_tree.setInputCloud(scan.makeShared());
  std::vector<int> nearest_map(scan.size(), -1), nearest_scan(map.size(), -1);
  for (std::size_t n = 0; n < scan.size(); ++n) {
    const int m = nearest_map[n] = nearest(map_tree, scan[n]);
    if (m < 0) continue;
    int& back = nearest_scan[static_cast<std::size_t>(m)];
    if (back < 0) back = nearest(scan_tree, map[static_cast<std::size_t>(m)]);
  }
  return mutualMatches(nearest_map, nearest_scan);
}

class FeatureMethod : public Method {
 public:
  FeatureMethod(const MapCloud& map, CloudMethodOptions options)
      : options_(std::move(options)), map_(describe(map, options_.feature_cell)) {
    if (map_.features->size() < kMinFeatures) {
      throw std::invalid_argument("feature map: got " + std::to_string(map_.features->size()) +
                                  " described points, wanted at least " + std::to_string(kMinFeatures));
    }
  }

  Estimate estimate(const ScanPoints& points, const Eigen::Isometry3d& T_map_prior,
                    const std::optional<Eigen::Vector3d>&) override {
    const Described scan = describeScan(points, options_.feature_cell);
    if (scan.features->size() < kMinFeatures) return {T_map_prior, false, 0, "too_few_points"};
    return alignDescribed(scan, T_map_prior);
  }
  std::size_t paperBytes() const override {
    return cloudPaperBytes(map_.cloud->size()) +
           featurePaperBytes(map_.features->size(), Feature::descriptorSize());
  }
  // Points, descriptors, and a tree that copies the descriptors.
  std::size_t memoryBytes() const override {
    return map_.cloud->size() * (sizeof(pcl::PointNormal) + 2 * sizeof(Feature) + sizeof(int));
  }

 protected:
  virtual Estimate alignDescribed(const Described& scan, const Eigen::Isometry3d& T_map_prior) = 0;

  CloudMethodOptions options_;
  Described map_;
};

class SampleConsensusMethod final : public FeatureMethod {
 public:
  SampleConsensusMethod(const MapCloud& map, const CloudMethodOptions& options)
      : FeatureMethod(map, options) {
    algorithm_.setInputTarget(map_.cloud);
    algorithm_.setTargetFeatures(map_.features);
    algorithm_.setMaximumIterations(options_.ransac_iterations);
    algorithm_.setNumberOfSamples(3);
    algorithm_.setCorrespondenceRandomness(5);
    algorithm_.setSimilarityThreshold(0.9f);
    algorithm_.setMaxCorrespondenceDistance(1.5 * options_.feature_cell);
    algorithm_.setInlierFraction(static_cast<float>(options_.ransac_inliers));
  }

 protected:
  Estimate alignDescribed(const Described& scan, const Eigen::Isometry3d& T_map_prior) override {
    std::srand(static_cast<unsigned>(options_.fast_global.fgr_seed));  // PCL draws from rand()
    algorithm_.setInputSource(scan.cloud);
    algorithm_.setSourceFeatures(scan.features);
    Cloud aligned;
    algorithm_.align(aligned);
    if (!algorithm_.hasConverged()) return {T_map_prior, false, 0, "not_converged"};
    return {orthonormalized(algorithm_.getFinalTransformation().cast<double>(), 1.0), true, 0, "converged"};
  }

 private:
  pcl::SampleConsensusPrerejective<pcl::PointNormal, pcl::PointNormal, Feature> algorithm_;
};

class FastGlobalMethod final : public FeatureMethod {
 public:
  FastGlobalMethod(const MapCloud& map, const CloudMethodOptions& options)
      : FeatureMethod(map, options), map_points_(positions(*map_.cloud)) {
    tree_.setInputCloud(map_.features);
  }

 protected:
  Estimate alignDescribed(const Described& scan, const Eigen::Isometry3d& T_map_prior) override {
    const auto scan_points = positions(*scan.cloud);
    const auto mutual = match(*scan.features, *map_.features, tree_);
    const auto kept = tupleTest(scan_points, map_points_, mutual, options_.fast_global);
    if (static_cast<int>(kept.size()) < options_.fast_global.fgr_min_matches) {
      return {T_map_prior, false, 0, "too_few_matches"};
    }
    return {alignCorrespondences(scan_points, map_points_, kept, options_.fast_global), true, 0, "converged"};
  }

 private:
  Tree tree_;
  Eigen::Matrix3Xf map_points_;
};

}  // namespace

std::unique_ptr<Method> makeFeatureMethod(const std::string& kind, const MapCloud& map_cloud,
                                          const CloudMethodOptions& options) {
  if (map_cloud.points.cols() == 0) {
    throw std::invalid_argument("map cloud: got no points, wanted at least one");
  }
  if (kind == "fpfh_ransac") return std::make_unique<SampleConsensusMethod>(map_cloud, options);
  if (kind == "fpfh_fgr") return std::make_unique<FastGlobalMethod>(map_cloud, options);
  throw std::invalid_argument("feature method: got '" + kind + "', wanted fpfh_ransac or fpfh_fgr");
}

}  // namespace ttsdf

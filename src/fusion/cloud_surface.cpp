#include "ttsdf_localization/fusion/cloud_surface.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <unordered_map>
#include <vector>

#include "cloud_normals.h"
#include "ttsdf_localization/build_steps/extent.h"
#include "ttsdf_localization/fusion/tsdf_volume_grids.h"
#include "ttsdf_localization/geometry/local_origin.h"
#include "ttsdf_localization/geometry/median.h"

namespace ttsdf {

namespace {

constexpr std::size_t kNeighbours = 12, kLeastPoints = 50;

/// One point per voxel: the mean of its points and of their normals.
struct Thinned {
  Eigen::Matrix3Xf points, normals;
};

Thinned thin(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xf& normals, const Eigen::Vector3d& origin,
             double cell) {
  struct Sum {
    Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
    double count = 0.0;
  };
  struct Hash {
    std::size_t operator()(const openvdb::Coord& c) const { return c.hash<20>(); }
  };
  std::unordered_map<openvdb::Coord, std::size_t, Hash> places;
  std::vector<Sum> sums;
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const Eigen::Vector3d p = points.col(n) - origin;
    if (!p.allFinite()) continue;
    const Eigen::Vector3d index = (p / cell).array().floor();
    const auto [place, is_new] = places.try_emplace(
        openvdb::Coord(static_cast<int>(index.x()), static_cast<int>(index.y()), static_cast<int>(index.z())),
        sums.size());
    if (is_new) sums.emplace_back();
    Sum& sum = sums[place->second];
    sum.point += p;
    if (normals.cols() > 0 && normals.col(n).allFinite()) sum.normal += normals.col(n).cast<double>();
    sum.count += 1.0;
  }
  Thinned result;
  result.points.resize(3, static_cast<Eigen::Index>(sums.size()));
  result.normals.resize(3, normals.cols() > 0 ? static_cast<Eigen::Index>(sums.size()) : 0);
  for (std::size_t n = 0; n < sums.size(); ++n) {
    result.points.col(static_cast<Eigen::Index>(n)) = (sums[n].point / sums[n].count).cast<float>();
    if (normals.cols() > 0)
      result.normals.col(static_cast<Eigen::Index>(n)) = sums[n].normal.normalized().cast<float>();
  }
  return result;
}

double medianSpacing(const Neighbours& neighbours) {
  if (neighbours.count < 2) return 0.0;
  std::vector<float> nearest;
  for (std::size_t n = 1; n < neighbours.squared_distance.size(); n += neighbours.count) {
    nearest.push_back(neighbours.squared_distance[n]);
  }
  return std::sqrt(static_cast<double>(upperMedian(nearest)));
}

/// Weighted means of distances to tangent planes. The nearer a point, the more it says.
class PlaneSums {
 public:
  PlaneSums(const FusionOptions& options, double reach)
      : voxel_(options.voxel_size),
        truncation_(options.truncation),
        reach_(reach),
        distance_(openvdb::FloatGrid::create(0.0F)),
        weight_(openvdb::FloatGrid::create(0.0F)),
        distance_at_(distance_->getAccessor()),
        weight_at_(weight_->getAccessor()) {}

  void add(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    const Eigen::Vector3d centre = point / voxel_;
    // The band is a disc of radius `reach_` and half height `truncation_`; its box is as small as its normal
    // lets it be.
    Eigen::Array3i low, high;
    for (int axis = 0; axis < 3; ++axis) {
      const double n = std::abs(normal[axis]);
      const double half = (truncation_ * n + reach_ * std::sqrt(std::max(0.0, 1.0 - n * n))) / voxel_;
      low[axis] = static_cast<int>(std::ceil(centre[axis] - half));
      high[axis] = static_cast<int>(std::floor(centre[axis] + half));
    }
    for (int i = low[0]; i <= high[0]; ++i) {
      for (int j = low[1]; j <= high[1]; ++j) {
        for (int k = low[2]; k <= high[2]; ++k) {
          const Eigen::Vector3d d = voxel_ * (Eigen::Vector3d(i, j, k) - centre);
          const double along = normal.dot(d), squared = d.squaredNorm();
          if (std::abs(along) > truncation_ || squared - along * along > reach_ * reach_) continue;
          const double floor = 0.25 * voxel_ * voxel_;
          const auto weight =
              static_cast<float>(1.0 / ((squared + floor) * (squared + floor)) * floor * floor);
          const openvdb::Coord ijk(i, j, k);
          weight_at_.setValue(ijk, weight_at_.getValue(ijk) + weight);
          distance_at_.setValue(ijk, distance_at_.getValue(ijk) + weight * static_cast<float>(along));
        }
      }
    }
  }

  void writeTo(TsdfVolume::Grids& grids) {
    auto tsdf = grids.tsdf->getAccessor(), weight = grids.weight->getAccessor();
    for (auto voxel = weight_->cbeginValueOn(); voxel; ++voxel) {
      const float value = distance_at_.getValue(voxel.getCoord()) / *voxel;
      if (std::abs(value) >= static_cast<float>(truncation_)) continue;
      tsdf.setValue(voxel.getCoord(), value);
      weight.setValue(voxel.getCoord(), 1.0F);
    }
  }

 private:
  double voxel_, truncation_, reach_;
  openvdb::FloatGrid::Ptr distance_, weight_;
  openvdb::FloatGrid::Accessor distance_at_, weight_at_;
};

/// Space in front of the surface is free up to a little beyond the band, or to the next surface.
void carveInFront(const Thinned& cloud, const FusionOptions& options, TsdfVolume::Grids& grids) {
  constexpr double kBeyond = 0.3;  // [m]
  auto free = grids.free->getAccessor();
  const auto tsdf = grids.tsdf->getConstAccessor();
  const double h = options.voxel_size;
  for (Eigen::Index n = 0; n < cloud.points.cols(); ++n) {
    const Eigen::Vector3d p = cloud.points.col(n).cast<double>(),
                          normal = cloud.normals.col(n).cast<double>();
    for (double t = 0.0; t < options.truncation + kBeyond; t += 0.5 * h) {
      const Eigen::Vector3d index = (p + t * normal) / h;
      const openvdb::Coord ijk = openvdb::Coord::round(openvdb::Vec3d(index.x(), index.y(), index.z()));
      float value = 0.0F;
      const bool band = tsdf.probeValue(ijk, value);
      if (band && value < 0.0F && t > h) break;
      if (!band && t > options.truncation) free.setValueOn(ijk);
    }
  }
}

}  // namespace

TsdfVolume volumeFromCloud(const OrientedCloud& cloud, const FusionOptions& options, CloudReport* report,
                           const BuildProgress& progress) {
  const auto reportProgress = [&progress](const char* step, double share) {
    if (progress && !progress(step, share)) throw std::runtime_error("cancelled");
  };
  if (cloud.normals.cols() > 0 && cloud.normals.cols() != cloud.points.cols()) {
    throw std::invalid_argument("cloud: got " + std::to_string(cloud.normals.cols()) + " normals for " +
                                std::to_string(cloud.points.cols()) + " points");
  }
  std::vector<Eigen::Vector3d> finite;
  for (Eigen::Index n = 0; n < cloud.points.cols(); ++n) {
    if (cloud.points.col(n).allFinite()) finite.emplace_back(cloud.points.col(n));
  }
  if (finite.size() < kLeastPoints) {
    throw std::invalid_argument("cloud: got " + std::to_string(finite.size()) +
                                " finite points, wanted at least " + std::to_string(kLeastPoints));
  }
  Eigen::Vector3d low = finite.front(), high = low;
  for (const Eigen::Vector3d& p : finite) low = low.cwiseMin(p), high = high.cwiseMax(p);
  try {
    checkExtent(low, high, options.voxel_size, finite, "points", "--scale S makes metres of other units");
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string("cloud: ") + error.what());
  }
  TsdfVolume volume(options);
  const Eigen::Vector3d origin = localOrigin(low, high);
  reportProgress("thinning", 0.0);
  Thinned thinned = thin(cloud.points, cloud.normals, origin, options.voxel_size);
  reportProgress("neighbours", 0.0);
  const Neighbours neighbours = nearestNeighbours(thinned.points, kNeighbours);
  CloudReport found;
  found.points = finite.size();
  found.spacing = medianSpacing(neighbours);
  found.outliers = describeOutliers(finite, "points");
  if (thinned.normals.cols() == 0) {
    reportProgress("normals", 0.0);
    found.normals_estimated = true;
    thinned.normals = planeNormals(thinned.points, neighbours);
    if (cloud.viewpoint) {
      const Eigen::Vector3f eye = (*cloud.viewpoint - origin).cast<float>();
      for (Eigen::Index n = 0; n < thinned.points.cols(); ++n) {
        if (thinned.normals.col(n).dot(eye - thinned.points.col(n)) < 0.0F) thinned.normals.col(n) *= -1.0F;
      }
    } else {
      orientTogether(thinned.points, neighbours, cloud.seen_from_inside, thinned.normals);
    }
  }
  constexpr double kReachVoxels = 1.5, kReachSpacings = 1.5, kMostVoxels = 4.0;
  PlaneSums sums(options, std::clamp(kReachSpacings * found.spacing, kReachVoxels * options.voxel_size,
                                     kMostVoxels * options.voxel_size));
  for (Eigen::Index n = 0; n < thinned.points.cols(); ++n) {
    if (n % 1000 == 0)
      reportProgress("surface", static_cast<double>(n) / static_cast<double>(thinned.points.cols()));
    const Eigen::Vector3d normal = thinned.normals.col(n).cast<double>();
    if (normal.allFinite() && normal.squaredNorm() > 0.5)
      sums.add(thinned.points.col(n).cast<double>(), normal);
  }
  sums.writeTo(volume.grids());
  carveInFront(thinned, options, volume.grids());
  volume.setOrigin(origin);
  if (report) *report = found;
  return volume;
}

}  // namespace ttsdf

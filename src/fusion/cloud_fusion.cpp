#include "cloud_fusion.h"

#include <openvdb/math/DDA.h>
#include <openvdb/math/Ray.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "depth/block_update.h"
#include "ttsdf_localization/sensor/sensor_model.h"

namespace ttsdf {

namespace {

/// Bundles per task. A constant, and the tasks' results are added in order: the sums do not depend on the
/// threads.
constexpr std::size_t kRaysPerTask = 1024;
/// A crossed voxel counts as free if the ray passes its sample within this distance [voxel]: a sample just
/// behind a surface is not carved by a ray that clips the corner of its cell.
constexpr double kFreeRadius = 0.7;

struct Hit {
  openvdb::Coord voxel;
  std::size_t index = 0;
  Eigen::Vector3d point;  ///< map frame [m]
};

struct Bundle {
  Eigen::Vector3d point;  ///< mean [m]
};

std::vector<Hit> findHits(const FusionOptions& options, const Eigen::Matrix3Xf& points,
                          const Eigen::Isometry3d& T_map_sensor) {
  std::vector<Hit> hits;
  hits.reserve(static_cast<std::size_t>(points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d p = points.col(i).cast<double>();
    const double range = p.norm();
    // OpenVDB's ray marching aborts on NaN and does not end for points far out: neither gets there.
    if (!(range >= options.min_depth && range <= options.max_depth && range > 0.0)) continue;
    Hit hit;
    hit.point = T_map_sensor * p;
    hit.index = static_cast<std::size_t>(i);
    const Eigen::Vector3d index = hit.point / options.voxel_size;
    hit.voxel = openvdb::Coord::round(openvdb::Vec3d(index.x(), index.y(), index.z()));
    hits.push_back(hit);
  }
  return hits;
}

std::vector<Bundle> bundleHits(std::vector<Hit> hits) {
  tbb::parallel_sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
    return a.voxel != b.voxel ? a.voxel < b.voxel : a.index < b.index;
  });
  std::vector<Bundle> bundles;
  for (std::size_t begin = 0; begin < hits.size();) {
    std::size_t end = begin;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (; end < hits.size() && hits[end].voxel == hits[begin].voxel; ++end) sum += hits[end].point;
    bundles.push_back({sum / static_cast<double>(end - begin)});
    begin = end;
  }
  return bundles;
}

/// Weighted distances and free voxels of (part of) one scan.
class ScanSums {
 public:
  ScanSums() : distance_(0.0F), weight_(0.0F) {}

  void addRays(const FusionOptions& options, const Eigen::Vector3d& origin,
               const std::vector<Bundle>& bundles, std::size_t begin, std::size_t end) {
    openvdb::tree::ValueAccessor<openvdb::FloatTree> distance(distance_), weight(weight_);
    openvdb::tree::ValueAccessor<openvdb::MaskTree> free(free_);
    const auto voxel_size = static_cast<float>(options.voxel_size),
               truncation = static_cast<float>(options.truncation);
    const SensorModel sensor = sensorModel(options.sensor);
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3d ray = bundles[i].point - origin;
      const double range = ray.norm();
      const Eigen::Vector3d direction = ray / range;
      const auto ray_weight = static_cast<float>(sensor.weight(range, options.readingFloor()));
      visitRay(options, origin, direction, range, [&](const openvdb::Coord& ijk, double along, double aside) {
        const auto signed_distance = static_cast<float>(range - along);
        if (signed_distance > truncation) {
          if (options.carve && aside <= kFreeRadius * options.voxel_size) free.setValueOn(ijk);
        } else if (signed_distance >= -truncation) {
          const float w = ray_weight * bandWeight(signed_distance, voxel_size, truncation);
          distance.setValueOn(ijk, distance.getValue(ijk) + w * signed_distance);
          weight.setValueOn(ijk, weight.getValue(ijk) + w);
        }
      });
    }
  }

  void add(const ScanSums& other) {
    addLeaves(other.distance_, distance_);
    addLeaves(other.weight_, weight_);
    free_.topologyUnion(other.free_);
  }

  std::vector<BlockVisit> visits() const {
    openvdb::MaskTree touched(free_);
    touched.topologyUnion(weight_);
    std::vector<BlockVisit> visits;
    for (auto leaf = touched.cbeginLeaf(); leaf; ++leaf) visits.push_back({leaf->origin(), false, 1.0F});
    return visits;
  }

  void observe(const openvdb::Coord& origin, BlockObservation& observation) const {
    if (const MaskLeaf* free = free_.probeConstLeaf(origin)) observation.free = free->getValueMask();
    const FloatLeaf* weight = weight_.probeConstLeaf(origin);
    if (!weight) return;
    const FloatLeaf* distance = distance_.probeConstLeaf(origin);
    for (auto voxel = weight->cbeginValueOn(); voxel; ++voxel) {
      const openvdb::Index n = voxel.pos();
      observation.weight[n] = *voxel;
      observation.distance[n] = distance->getValue(n) / *voxel;
      observation.free.setOff(n);  // a surface this near is the better witness of the two
    }
    observation.has_band = true;
  }

 private:
  /// Calls visit(voxel, its sample's distance along the ray, and aside of it) from the sensor to the end of
  /// the band.
  template <class Visit>
  static void visitRay(const FusionOptions& options, const Eigen::Vector3d& origin,
                       const Eigen::Vector3d& direction, double range, const Visit& visit) {
    using Ray = openvdb::math::Ray<double>;
    const Eigen::Vector3d eye = origin / options.voxel_size;
    // The DDA's voxel i is the cell [i, i + 1); a sample is the centre of [i - 1/2, i + 1/2).
    const Ray ray(Ray::Vec3T(eye.x() + 0.5, eye.y() + 0.5, eye.z() + 0.5),
                  Ray::Vec3T(direction.x(), direction.y(), direction.z()), 0.0,
                  (range + options.truncation) / options.voxel_size);
    openvdb::math::DDA<Ray> dda(ray);
    do {
      const openvdb::Coord ijk = dda.voxel();
      const Eigen::Vector3d offset = options.voxel_size * Eigen::Vector3d(ijk.x(), ijk.y(), ijk.z()) - origin;
      const double along = offset.dot(direction);
      visit(ijk, along, (offset - along * direction).norm());
    } while (dda.step());
  }

  static void addLeaves(const openvdb::FloatTree& from, openvdb::FloatTree& to) {
    for (auto leaf = from.cbeginLeaf(); leaf; ++leaf) {
      FloatLeaf* sum = to.touchLeaf(leaf->origin());
      for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) {
        sum->setValueOn(voxel.pos(), sum->getValue(voxel.pos()) + *voxel);
      }
    }
  }

  openvdb::FloatTree distance_, weight_;
  openvdb::MaskTree free_;
};

}  // namespace

void fuseCloud(TsdfVolume::Grids& grids, const FusionOptions& options, const Eigen::Matrix3Xf& points,
               const Eigen::Isometry3d& T_map_sensor) {
  const std::vector<Bundle> bundles = bundleHits(findHits(options, points, T_map_sensor));
  const Eigen::Vector3d origin = T_map_sensor.translation();
  std::vector<ScanSums> parts((bundles.size() + kRaysPerTask - 1) / kRaysPerTask);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
    parts[i].addRays(options, origin, bundles, i * kRaysPerTask,
                     std::min(bundles.size(), (i + 1) * kRaysPerTask));
  });
  ScanSums sums;
  for (const ScanSums& part : parts) sums.add(part);
  const std::vector<BlockVisit> visits = sums.visits();
  updateBlocks(grids, options, visits, [&](std::size_t index, BlockObservation& observation) {
    sums.observe(visits[index].origin, observation);
  });
}

}  // namespace ttsdf

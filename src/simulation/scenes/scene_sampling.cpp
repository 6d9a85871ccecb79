#include "ttsdf_localization/simulation/scene_sampling.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace ttsdf {

namespace {

/// Halves a block of samples until it is small, keeping only the solids that can be nearest somewhere in it.
class BlockSampler {
 public:
  BlockSampler(const AnalyticScene& scene, const GridGeometry& geometry, const Dims& begin, const Dims& size,
               float* out)
      : solids_(scene.solids()), geometry_(geometry), begin_(begin), size_(size), out_(out) {}

  void run() {
    std::vector<int> all(solids_.size());
    std::iota(all.begin(), all.end(), 0);
    descend(begin_, size_, all);
  }

 private:
  static constexpr int kLeafSamples = 8;

  void descend(const Dims& begin, const Dims& size, const std::vector<int>& candidates) {
    const Eigen::Vector3d half = 0.5 * (size - 1).cast<double>().matrix();
    const Eigen::Vector3d center = geometry_.samplePosition(begin.cast<double>().matrix() + half);
    const std::vector<int> kept = candidatesNear(center, geometry_.voxel_size * half.norm(), candidates);
    int axis = 0;
    const int longest = size.maxCoeff(&axis);
    if (longest <= kLeafSamples || kept.size() == 1) {
      fill(begin, size, kept);
      return;
    }
    Dims first = size, second = size, middle = begin;
    first[axis] = longest / 2;
    second[axis] = longest - first[axis];
    middle[axis] += first[axis];
    descend(begin, first, kept);
    descend(middle, second, kept);
  }

  /// A distance changes by at most `radius` between the centre and any point of the ball, whichever solid it
  /// is to.
  std::vector<int> candidatesNear(const Eigen::Vector3d& center, double radius,
                                  const std::vector<int>& candidates) {
    distances_.resize(candidates.size());
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      distances_[i] = solids_[static_cast<std::size_t>(candidates[i])].signedDistance(center);
      nearest = std::min(nearest, distances_[i]);
    }
    std::vector<int> kept;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (distances_[i] <= nearest + 2.0 * radius) kept.push_back(candidates[i]);
    }
    return kept;
  }

  void fill(const Dims& begin, const Dims& size, const std::vector<int>& candidates) {
    for (int k = begin[2]; k < begin[2] + size[2]; ++k) {
      for (int j = begin[1]; j < begin[1] + size[1]; ++j) {
        float* row = out_ + offset(begin[0], j, k);
        for (int i = 0; i < size[0]; ++i) {
          const Eigen::Vector3d p = geometry_.samplePosition(Eigen::Vector3d(begin[0] + i, j, k));
          double distance = std::numeric_limits<double>::infinity();
          for (const int c : candidates) {
            distance = std::min(distance, solids_[static_cast<std::size_t>(c)].signedDistance(p));
          }
          row[i] = static_cast<float>(distance);
        }
      }
    }
  }

  std::size_t offset(int i, int j, int k) const {
    const Eigen::Array<std::size_t, 3, 1> n = size_.cast<std::size_t>();
    const Dims local = Dims(i, j, k) - begin_;
    const Eigen::Array<std::size_t, 3, 1> at = local.cast<std::size_t>();
    return at[0] + n[0] * (at[1] + n[1] * at[2]);
  }

  const std::vector<Solid>& solids_;
  const GridGeometry& geometry_;
  const Dims begin_, size_;
  float* out_;
  std::vector<double> distances_;
};

}  // namespace

GridGeometry gridOver(const Eigen::AlignedBox3d& box, double voxel_size, double margin) {
  if (box.isEmpty() || !(voxel_size > 0.0) || !(margin >= 0.0)) {
    std::ostringstream message;
    message << "gridOver: got voxel size " << voxel_size << " m, margin " << margin << " m, box sides "
            << box.sizes().transpose() << " m; wanted positive ones";
    throw std::invalid_argument(message.str());
  }
  GridGeometry geometry;
  geometry.voxel_size = voxel_size;
  const Eigen::Vector3d sides = box.sizes() + Eigen::Vector3d::Constant(2.0 * margin);
  // The small slack keeps 7.0 m / 0.02 m from becoming 351 steps by rounding.
  geometry.dims = (sides / voxel_size - Eigen::Vector3d::Constant(1e-6)).array().ceil().cast<int>() + 1;
  geometry.T_map_grid.translation() = box.min() - Eigen::Vector3d::Constant(margin);
  return geometry;
}

void sampleDistances(const AnalyticScene& scene, const GridGeometry& geometry, const Dims& begin,
                     const Dims& size, float* out) {
  if ((begin < 0).any() || (size < 1).any() || (begin + size > geometry.dims).any() ||
      scene.solids().empty()) {
    std::ostringstream message;
    message << "sampleDistances: got samples " << begin.transpose() << " + " << size.transpose()
            << " of a grid of " << geometry.dims.transpose() << " and " << scene.solids().size()
            << " solids, wanted a range inside the grid and at least one solid";
    throw std::invalid_argument(message.str());
  }
  BlockSampler(scene, geometry, begin, size, out).run();
}

DenseTensor sampleDistances(const AnalyticScene& scene, const GridGeometry& geometry) {
  DenseTensor tensor(geometry.dims);
  sampleDistances(scene, geometry, Dims::Zero(), geometry.dims, tensor.data());
  return tensor;
}

}  // namespace ttsdf

#pragma once
// What was observed, as plain dense arrays over a box: the meeting point of fusion (OpenVDB) and the
// algorithms that make a signed field of it, which are tested without OpenVDB.

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

class TsdfVolume;

/// What is known about one sample.
enum class Observation : std::uint8_t {
  kUnknown,   ///< no ray got there
  kFree,      ///< crossed by rays, beyond the truncation of every surface
  kBand,      ///< signed distance within the truncation
  kInterior,  ///< inside matter beyond the band (closed level sets only)
};

struct ObservedGrid {
  Dims dims = Dims::Zero();
  Eigen::Array3i origin =
      Eigen::Array3i::Zero();      ///< sample (i, j, k) sits at voxel_size * (origin + (i, j, k)), map frame
  double voxel_size = 0.0;         ///< [m]
  double truncation = 0.0;         ///< [m]
  std::vector<float> tsdf;         ///< [m], first index fastest; meaningful where kBand
  std::vector<Observation> state;  ///< same order

  std::size_t offset(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(dims[0]) *
               (static_cast<std::size_t>(j) +
                static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(k));
  }
  std::size_t size() const { return state.size(); }
};

/// Throws std::invalid_argument if arrays and dims disagree or an extent is below 2.
void check(const ObservedGrid& grid);

/// Dense copy of a volume over the box of its band plus `margin` voxels on every side.
/// Throws std::runtime_error if no surface was observed.
ObservedGrid observedGrid(const TsdfVolume& volume, int margin, int threads = 2);
/// The samples [origin, origin + dims) of a volume.
ObservedGrid observedGrid(const TsdfVolume& volume, const Eigen::Array3i& origin, const Dims& dims,
                          int threads);

}  // namespace ttsdf

#pragma once
// A small map with everything in it: an analytic field (a box room with a ball), a turned grid, a mask,
// metadata.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "ttsdf_localization/compression/map_writer.h"
#include "ttsdf_localization/compression/tt_svd.h"

namespace ttsdf::test {

/// Distance to the walls of a room and to a ball in it [m], clamped as maps are; index coordinates times 0.1
/// m.
inline float roomValue(const Dims& dims, int i, int j, int k) {
  const Eigen::Array3d index(i, j, k), size = (dims - 1).cast<double>();
  const double walls = 0.1 * std::min((index - 1.5).minCoeff(), (size - 1.5 - index).minCoeff());
  const double ball = 0.1 * ((index - 0.4 * size).matrix().norm() - 0.2 * size.minCoeff());
  return static_cast<float>(std::clamp(std::min(walls, ball), -0.3, 0.5));
}

inline DenseTensor roomTensor(const Dims& dims) {
  DenseTensor tensor(dims);
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) tensor(i, j, k) = roomValue(dims, i, j, k);
    }
  }
  return tensor;
}

inline SupportMask roomMask(const Dims& dims, int cell_voxels) {
  SupportMask mask(dims, cell_voxels, false);
  for (int c = 0; c < mask.cellDims()[2]; ++c) {
    for (int b = 0; b < mask.cellDims()[1]; ++b) {
      for (int a = 0; a < mask.cellDims()[0]; ++a) {
        mask.set(a, b, c, (Eigen::Array3i(a, b, c) * cell_voxels < dims * 2 / 3).all());
      }
    }
  }
  return mask;
}

inline TtSdfMap roomMap(const Dims& dims = Dims(30, 21, 25), int rank = 8) {
  TtSdfMap map;
  map.geometry.dims = dims;
  map.geometry.voxel_size = 0.1;
  map.geometry.T_map_grid.translate(Eigen::Vector3d(-1.25, 0.5, 3.75));
  map.geometry.T_map_grid.rotate(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1.0, 2.0, -0.5).normalized()));
  TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = rank;
  map.train = ttSvd(roomTensor(dims), options).train;
  map.mask = roomMask(dims, 4);
  map.truncation = 0.3;
  map.clamp_negative = 0.3;
  map.clamp_positive = 0.5;
  map.frame_id = "etage_1";
  map.agreement.compared = 40, map.agreement.contradicting = 1, map.agreement.without_overlap = 2;
  map.agreement.position_median = 0.011, map.agreement.position_90 = 0.023;
  map.agreement.rotation_median = 0.006, map.agreement.rotation_90 = 0.013;
  map.agreement.widening = 1.5, map.agreement.shift = 0.007, map.agreement.turn_sensor = 0.004,
  map.agreement.turn_scene = 0.002;
  map.agreement.viewpoint_distance = 0.5;
  map.agreement.viewpoints = {{{{1.0, -2.0, 0.25}, {0.0, 0.5, -0.75}}, 7, 1.5},
                              {{{-300.0, 0.0, 12.0}, {-0.9, 0.1, 0.0}}, 1, 0.25}};
  map.metadata = {{"builder", "a test"},
                  {"ort",
                   "K\xC3\xBC"
                   "che"},
                  {"empty", ""}};
  return map;
}

/// rms of the difference of two trains over the full array.
inline double rmsDifference(const TensorTrain& a, const TensorTrain& b) {
  const DenseTensor x = full(a), y = full(b);
  double sum = 0.0;
  for (std::size_t n = 0; n < x.size(); ++n) {
    const double d = static_cast<double>(x.data()[n]) - static_cast<double>(y.data()[n]);
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(x.size()));
}

inline double rmsValue(const TensorTrain& a) {
  const DenseTensor x = full(a);
  double sum = 0.0;
  for (std::size_t n = 0; n < x.size(); ++n)
    sum += static_cast<double>(x.data()[n]) * static_cast<double>(x.data()[n]);
  return std::sqrt(sum / static_cast<double>(x.size()));
}

inline EncodeOptions encodeAs(Encoding encoding, double rms = 0.0) {
  EncodeOptions options;
  options.encoding = encoding;
  options.quantization_rms = rms;
  return options;
}

}  // namespace ttsdf::test

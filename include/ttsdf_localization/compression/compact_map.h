#pragma once
// The smallest file for the accuracy that matters, or the best accuracy for a file size: sparse fit and
// quantisation, each done for the other.

#include <cstdint>
#include <functional>
#include <vector>

#include "ttsdf_localization/compression/sparse_fit.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

struct CompactOptions {
  /// Coarseness [m] if no target is set, else where the search begins. Half of it makes the file about twice
  /// as large.
  double threshold = 0.01;
  /// Largest file; 0: off.
  std::size_t target_bytes = 0;
  /// Largest error by the measure below, with the smallest file that keeps it; 0: off. target_bytes goes
  /// first.
  double target_error = 0.0;
  /// What the caller calls the error of a train [m], e.g. the rms near the surface; needed for target_error.
  std::function<double(const TensorTrain&)> error;
  int iterations = 20;  ///< of the sparse fit, for every threshold tried
  int threads = 1;
  /// Asked after every iteration with the share done (an estimate); false: std::runtime_error "cancelled".
  std::function<bool(double)> keep_going;
};

struct CompactMap {
  std::vector<std::uint8_t> bytes;  ///< the file, quantised encoding
  TtSdfMap map;                     ///< as a reader of `bytes` sees it
  double threshold = 0.0;           ///< that was used [m]
};

/// `map` with a train as ttSvd or fitWeighted make it; its bases are kept. Values [m] and weights as for
/// fitSparse. Throws std::invalid_argument for options out of range or a target_bytes out of reach. A
/// target_error out of reach of the ranks gives the most exact map tried.
CompactMap compactMap(const TtSdfMap& map, const WeightedSlabSource& source, const CompactOptions& options);
CompactMap compactMap(const TtSdfMap& map, const DenseTensor& values, const std::vector<float>& weights,
                      const CompactOptions& options);

}  // namespace ttsdf

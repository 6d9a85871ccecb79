#pragma once
// A train whose middle core is made to be stored: of all middle cores that describe the samples that matter,
// one with few cosine coefficients. Where a map knows nothing, any value will do, and that freedom is worth
// more bytes than any entropy coder saves.

#include <functional>
#include <vector>

#include "ttsdf_localization/compression/tt_weighted.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

struct SparseFitOptions {
  /// Weight of the l1 norm [m]: a coefficient is worth storing if leaving it out changes the weighted samples
  /// by more. A quantisation step of about four thresholds fits the result.
  double threshold = 0.005;
  int iterations = 16;
  int threads = 1;
  /// Asked after every iteration with the share done; false ends the fit early (the result so far is good).
  std::function<bool(double)> keep_going;
};

/// Minimises 1/2 sum w (F - TT)^2 + threshold sum |c| over the cosine coefficients c of the middle core
/// (along its mode), with the bases of `start` kept: fast iterative shrinkage-thresholding (Beck, Teboulle
/// 2009) with restarts. Weights in [0, 1]; 0: don't care. The result's first and last core are orthonormal,
/// so that the quantised encoding keeps its coefficients. Throws std::invalid_argument for negative options.
TensorTrain fitSparse(const WeightedSlabSource& source, const TensorTrain& start,
                      const SparseFitOptions& options);

/// The same on a dense tensor; weights one per entry in the tensor's order. Throws if shapes differ.
TensorTrain fitSparse(const DenseTensor& tensor, const std::vector<float>& weights, const TensorTrain& start,
                      const SparseFitOptions& options);

}  // namespace ttsdf

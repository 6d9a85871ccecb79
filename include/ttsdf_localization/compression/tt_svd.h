#pragma once
// TT-SVD (Oseledets 2011) for three modes, from a dense array or streamed slab by slab.

#include <functional>
#include <optional>
#include <vector>

#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

struct TtSvdOptions {
  int max_rank1 = 0;              ///< cap on r1; 0: none
  int max_rank2 = 0;              ///< cap on r2; 0: none
  double tolerance = 0.0;         ///< relative Frobenius error allowed; 0: none
  std::optional<ModeOrder> axes;  ///< default: defaultModeOrder(dims)
  int threads = 1;                ///< above 1 a slab source is called from several threads at once
};

struct TtSvdResult {
  TensorTrain train;
  std::vector<double> spectrum1;  ///< singular values of the first unfolding, falling
  std::vector<double> spectrum2;  ///< singular values of the second (projected) unfolding, falling
  double relative_error = 0.0;    ///< bound on |F - TT| / |F| from the values cut off
};

/// Throws std::invalid_argument for negative options, an empty tensor or one with non-finite entries,
/// std::runtime_error if the eigensolver fails.
/// Gram matrices in double and a symmetric eigensolver: singular values below 1e-8 of the largest are noise.
TtSvdResult ttSvd(const DenseTensor& tensor, const TtSvdOptions& options);

/// Fills `slab` (n1 x n3, column-major, chain order) with the entries whose middle index is j.
using SlabSource = std::function<void(int j, Eigen::Ref<Eigen::MatrixXf> slab)>;

/// The same without the dense array in memory: the source is asked for every slab twice.
/// Memory: n1^2 + n3^2 doubles, eightfold above one thread, and r1 n2 n3 floats. The result depends on the
/// number of threads by rounding in double only.
TtSvdResult ttSvd(const Dims& dims, const SlabSource& source, const TtSvdOptions& options);

/// Recompression of a train to lower ranks (same options; `axes` is ignored), without the full array: QR of
/// the outer cores, then TT-SVD of what is between them (Oseledets 2011, TT-rounding).
TensorTrain round(const TensorTrain& tt, const TtSvdOptions& options);

}  // namespace ttsdf

#pragma once

#include <vector>

#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

struct Spectra {
  std::vector<double> first;   ///< singular values of the n1 x (n2 n3) unfolding, falling
  std::vector<double> second;  ///< of the (n1 n2) x n3 unfolding, falling
};

/// Singular values of the whole array's unfoldings, computed on the cores: r1 and r2 values. Values below
/// 1e-8 of the largest are noise (Gram matrices in double).
Spectra spectra(const TensorTrain& train);

}  // namespace ttsdf

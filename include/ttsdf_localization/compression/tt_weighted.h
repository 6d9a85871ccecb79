#pragma once
// A tensor train fitted to weighted samples: plain TT-SVD spends its ranks on every entry alike.

#include <functional>
#include <vector>

#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

struct WeightedFitOptions {
  int iterations = 30;
  int threads = 1;
  /// Asked after every sweep with the share done; false ends the fit early (the result so far is good).
  std::function<bool(double)> keep_going;
};

/// Fills values [m] and weights of middle index j (n1 x n3, column-major, chain order of the start train),
/// from column `begin` (a multiple of 64) on as many columns as there is room for. Called from several
/// threads at once.
using WeightedSlabSource = std::function<void(int j, int begin, Eigen::Ref<Eigen::MatrixXf> values,
                                              Eigen::Ref<Eigen::MatrixXf> weights)>;

/// Minimises sum w (F - TT)^2 from `start` at its ranks. Weights in [0, 1], one per entry in the tensor's
/// order; 0 means "don't care". Expectation-maximisation for weighted low-rank approximation (Srebro,
/// Jaakkola 2003) with over-relaxation; every sweep completes the array with the current train and takes one
/// orthogonal iteration on the first and last core. Throws std::invalid_argument if the shapes differ.
TensorTrain fitWeighted(const DenseTensor& tensor, const std::vector<float>& weights,
                        const TensorTrain& start, const WeightedFitOptions& options);
/// The same slab by slab: every slab is asked for twice a sweep.
TensorTrain fitWeighted(const WeightedSlabSource& source, const TensorTrain& start,
                        const WeightedFitOptions& options);

/// sqrt(sum w (F - TT)^2 / sum w).
double weightedRms(const DenseTensor& tensor, const std::vector<float>& weights, const TensorTrain& train);

}  // namespace ttsdf

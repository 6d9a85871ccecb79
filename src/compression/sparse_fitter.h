#pragma once
// The solver behind fitSparse and compactMap: it keeps its state, so that a search for the right threshold
// goes on from the solution of the last one.

#include "../map/codec/coefficients/cosine_transform.h"
#include "encoder/train_gauge.h"
#include "ttsdf_localization/compression/sparse_fit.h"

namespace ttsdf {

class SparseFitter {
 public:
  /// The source must outlive it.
  SparseFitter(const WeightedSlabSource& source, const TensorTrain& start, int threads);
  /// With bases as they are; the middle core of the gauge is not used.
  SparseFitter(const WeightedSlabSource& source, TrainGauge bases, int threads);

  /// What the weighted samples miss with these coefficients, as coefficients: minus the gradient of half the
  /// weighted square error.
  Eigen::MatrixXf missing(const Eigen::MatrixXf& coefficients) const {
    return cosines_.toFrequencies(project(cosines_.fromFrequencies(coefficients, threads_)), threads_);
  }

  /// Runs `iterations` from where the last run ended. `share_done` goes to keep_going; false if that ended
  /// the run.
  bool run(double threshold, int iterations, const std::function<bool(double)>& keep_going);
  /// Thresholds of their own from now on: half of it for coefficients that stand out (they are shrunk less),
  /// twice of it for the others (they vanish).
  void reweight(double threshold);
  void forgetWeights() { factors_.resize(0, 0); }

  TensorTrain train() const;

 private:
  Eigen::MatrixXf project(const Eigen::MatrixXf& slices) const;

  const WeightedSlabSource& source_;
  TrainGauge gauge_;  // M is not used
  CosineTransform cosines_;
  Eigen::MatrixXf Ut_, Vt_;
  Eigen::MatrixXf coefficients_;  // (r1 r2) x n2, by frequency
  Eigen::MatrixXf factors_;       // of the threshold, per coefficient; empty: 1
  int threads_;
};

}  // namespace ttsdf

#pragma once
// A sampled field as compression reads it: slab by slab in the train's chain order, wherever the samples are
// kept, with the weights of the fit.

#include <memory>
#include <vector>

#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/compression/tt_weighted.h"
#include "ttsdf_localization/mapping/map_builder.h"

namespace ttsdf {

/// Errors of a train against the sampled field.
struct FieldError {
  double relative = 0.0;   ///< |F - TT| / |F| over the whole box
  double surface = 0.0;    ///< rms of known voxels within 3 cm of the surface [m]
  double total_rms = 0.0;  ///< over the whole box [m]
};

class FieldSlabs {
 public:
  /// `field` must outlive it. Throws std::invalid_argument if its arrays disagree.
  FieldSlabs(const SampledField& field, const BuildOptions& options);

  const Dims& dims() const { return field_.geometry.dims; }
  const ModeOrder& axes() const { return axes_; }
  SlabSource values() const;
  /// Weight in (0, 1] per voxel: 1 at the surface, falling with the distance from it, little where the map
  /// knows nothing (those values mean nothing, and only have to stay smooth). Not to be called from several
  /// threads.
  WeightedSlabSource weighted() const;

  FieldError compare(const TensorTrain& train) const;
  /// Of the box.
  double knownShare() const;

 private:
  using Flags = std::vector<std::uint8_t>;
  /// All slabs side by side.
  struct Cache {
    Eigen::MatrixXf values, weights;
  };

  const Cache& cache() const;
  void readWeighted(int j, int begin, Eigen::Ref<Eigen::MatrixXf> values,
                    Eigen::Ref<Eigen::MatrixXf> weights) const;
  int mode(int n) const { return axes_[static_cast<std::size_t>(n)]; }
  int size(int n) const { return field_.geometry.dims[mode(n)]; }
  /// Values of middle index j from column `begin` on, column-major; `known`, if given, likewise.
  void read(int j, int begin, Eigen::Ref<Eigen::MatrixXf> values, Flags* known) const;
  void computeWeights(int j, int begin, const Eigen::Ref<const Eigen::MatrixXf>& values, const Flags& known,
                      Eigen::Ref<Eigen::MatrixXf> weights) const;

  const SampledField& field_;
  ModeOrder axes_;
  int threads_;
  mutable std::unique_ptr<const Cache> cache_;  ///< of dense arrays, which leave room for it
  float reach_;  ///< distance from the surface at which weights have fallen to their least [m]
};

}  // namespace ttsdf

#include "field_weights.h"

#include <algorithm>
#include <cmath>

namespace ttsdf {

std::vector<float> surfaceWeights(const SampledField& field, const BuildOptions& options) {
  constexpr float kFar = 0.05f;      // weight at the clamp
  constexpr float kUnknown = 0.01f;  // of a voxel that no ray saw
  const float reach = static_cast<float>(options.clamp_positive > 0.0 ? options.clamp_positive : 0.5);
  const auto& dims = field.values.dims();
  std::vector<float> weights(field.values.size());
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        const std::size_t n = field.values.offset(i, j, k);
        const float near = std::max(0.0f, 1.0f - std::abs(field.values.data()[n]) / reach);
        const bool known = field.known[n] != 0 && field.mask.atVoxel(i, j, k);
        weights[n] = known ? std::max(kFar, near * near) : kUnknown;
      }
    }
  }
  return weights;
}

}  // namespace ttsdf

#pragma once
// The noise of one row of one picture. Every row has a random stream of its own, so that a picture does not
// depend on how its rows are shared among threads.

#include <cmath>
#include <cstdint>
#include <random>

#include "ttsdf_localization/simulation/depth_noise.h"

namespace ttsdf {

/// SplitMix64 (Steele et al. 2014): cheap to seed, so that every row has a stream of its own.
class SplitMix {
 public:
  using result_type = std::uint64_t;
  explicit SplitMix(std::uint64_t seed) : state_(seed) {}
  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return ~result_type{0}; }
  result_type operator()() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  double uniform() { return static_cast<double>((*this)() >> 11) * 0x1.0p-53; }

 private:
  std::uint64_t state_;
};

/// Depth step between neighbours that counts as a discontinuity [share of the depth].
inline constexpr double kEdgeStep = 0.05;

/// Whether pixel u of a row of depths (infinity: nothing there) lies at a discontinuity.
inline bool atDepthEdge(const double* depth, std::size_t width, std::size_t u) {
  const double z = depth[u];
  const bool left = u > 0 && std::abs(depth[u - 1] - z) > kEdgeStep * z;
  return left || (u + 1 < width && std::abs(depth[u + 1] - z) > kEdgeStep * z);
}

class RowNoise {
 public:
  RowNoise(const DepthNoiseOptions& options, double fx, std::uint64_t frame, int row);

  /// Whether the sensor finds anything at a pixel; `cosine` of the angle between ray and normal, asked for
  /// only if needed.
  template <class CosineOf>
  bool returns(bool at_edge, const CosineOf& cosine) {
    if (options_.dropout > 0.0 && random_.uniform() < options_.dropout) return false;
    if (options_.edge_dropout > 0.0 && at_edge && random_.uniform() < options_.edge_dropout) return false;
    return !(grazing_cosine_ > 0.0) || cosine() >= grazing_cosine_;
  }
  /// The reading for a true depth [m]; 0: none.
  double measure(double depth);

 private:
  const DepthNoiseOptions& options_;
  double disparity_scale_, grazing_cosine_;
  SplitMix random_;
  std::normal_distribution<double> normal_;
};

}  // namespace ttsdf

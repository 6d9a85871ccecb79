#pragma once
// Numbers to small integers and back.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "coefficients/coefficient_coder.h"

namespace ttsdf {

/// A magnitude q covers [q - 1 + threshold, q + threshold) steps: the dead zone around zero is wider than a
/// rounding quantiser's, because most of what lies just above half a step costs more bits than it is worth.
inline std::int32_t quantizeNumber(double value, double step, double threshold) {
  const double magnitude = std::floor(std::abs(value) / step + 1.0 - threshold);
  const auto q = static_cast<std::int32_t>(std::min(magnitude, static_cast<double>(kMaxCoefficient)));
  return value < 0.0 ? -q : q;
}

/// Where a magnitude of 1 and a larger one are put back, off their integer [1/128 step].
using Offsets = std::array<std::int8_t, 2>;

inline float dequantizeNumber(std::int32_t q, double step, const Offsets& offsets) {
  if (q == 0) return 0.0f;
  const int magnitude = std::abs(q);
  const double value = step * (magnitude + offsets[magnitude > 1 ? 1 : 0] / 128.0);
  return static_cast<float>(q < 0 ? -value : value);
}

/// Collects where the values of a magnitude really lie; their mean is the best place to put them back.
class OffsetMean {
 public:
  void add(std::int32_t q, double value, double step) {
    if (q == 0) return;
    const std::size_t k = std::abs(q) > 1 ? 1 : 0;
    sum_[k] += std::abs(value) / step - std::abs(q);
    ++count_[k];
  }
  Offsets offsets() const {
    Offsets result{};
    for (std::size_t k = 0; k < 2; ++k) {
      if (count_[k] == 0) continue;
      const double scaled = std::round(128.0 * sum_[k] / static_cast<double>(count_[k]));
      result[k] = static_cast<std::int8_t>(std::clamp(scaled, -127.0, 127.0));
    }
    return result;
  }

 private:
  std::array<double, 2> sum_{};
  std::array<std::size_t, 2> count_{};
};

/// step * 2^(quarters / 4), equal on every machine.
inline double quarterOctavesAbove(double step, int quarters) {
  constexpr double kQuarters[4] = {1.0, 1.189207115002721, 1.4142135623730951, 1.681792830507429};
  return std::ldexp(step * kQuarters[quarters % 4], quarters / 4);
}

}  // namespace ttsdf

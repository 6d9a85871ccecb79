#pragma once
// The quantised encoding as it is stored. In the gauge of train_gauge.h an error of the middle core is an
// error of the same size in the full array, so one step serves all its (cosine-transformed) coefficients:
// exact reverse water-filling. A column of U or V is multiplied by what its slice of the middle core carries,
// so its step is smaller by that factor.

#include "../format/byte_io.h"
#include "../format/encoding.h"
#include "coefficients/coefficient_coder.h"
#include "scalar_quantizer.h"

namespace ttsdf {

/// Columns of U or V by frequency; every column with its own step.
struct QuantizedBasis {
  float finest_step = 0.0f;
  std::vector<std::uint8_t> coarseness;  ///< of every column: finest_step * 2^(coarseness / 4)
  Offsets offsets{};
  CoefficientBlock values;  ///< n x r x 1

  double step(Eigen::Index column) const {
    return quarterOctavesAbove(finest_step, coarseness[static_cast<std::size_t>(column)]);
  }
  /// n x r, by place.
  Eigen::MatrixXf decoded() const;
};

/// Everything a decoder needs, before entropy coding.
struct QuantizedCores {
  CoreHeader header;
  QuantizedBasis first, last;
  float step = 0.0f;  ///< of the middle core [m]
  Offsets offsets{};
  CoefficientBlock middle;  ///< r1 x r2 x n2, by frequency along the last

  /// (r1 r2) x n2, by place.
  Eigen::MatrixXf decodedMiddle() const;
};

/// Throws MapFormatError.
QuantizedCores readQuantized(ByteReader& in, const CoreHeader& header);
TensorTrain dequantize(const QuantizedCores& cores);

}  // namespace ttsdf

#pragma once
// The quantised encoding. In the gauge of train_gauge.h an error of the middle core is an error of the same
// size in the full array, so one step serves all its (cosine-transformed) coefficients: exact reverse
// water-filling. A column of U or V is multiplied by what its slice of the middle core carries, so its step
// is smaller by that factor.

#include "byte_io.h"
#include "coefficient_coder.h"
#include "encoding.h"
#include "train_gauge.h"

namespace ttsdf {

/// Everything a decoder needs, before entropy coding.
struct QuantizedCores {
  CoreHeader header;
  float step = 0.0f;                               ///< of the middle core [m]
  std::vector<std::uint8_t> fineness1, fineness2;  ///< column steps of U and V: step * 2^(-fineness / 4)
  /// Where a magnitude of 1 and of more is put back, off its integer [1/128 step]; [0] middle core, [1] U and
  /// V.
  std::array<std::array<std::int8_t, 2>, 2> offsets{};
  CoefficientBlock first, middle, last;  ///< n1 x r1; r1 x r2 x n2; n3 x r2; by frequency along the modes
};

class QuantizedEncoder {
 public:
  /// A section in which everything is zero is smaller than this, whatever the train.
  static constexpr std::size_t kSmallestBytes = 512;

  explicit QuantizedEncoder(const TensorTrain& train);

  /// Quantisation error at most `rms` [m] over the full array (checked on the result).
  QuantizedCores quantizeToRms(double rms) const;
  /// The finest quantisation found whose section has at most `bytes` (>= kSmallestBytes).
  QuantizedCores quantizeToBytes(std::size_t bytes) const;
  QuantizedCores quantize(double step) const;
  /// rms over the full array of what quantisation changes [m]; exact.
  double errorRms(const QuantizedCores& cores) const;
  /// The step that gives about this error if all coefficients were quantised finely [m].
  double stepForRms(double rms) const;

 private:
  TrainGauge gauge_;
  double entries_;  ///< of the full array
};

void writeQuantized(const QuantizedCores& cores, ByteWriter& out);
QuantizedCores readQuantized(ByteReader& in, const CoreHeader& header);
TensorTrain dequantize(const QuantizedCores& cores);

}  // namespace ttsdf

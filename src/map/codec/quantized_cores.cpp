#include "quantized_cores.h"

#include "coefficients/coefficient_model.h"
#include "coefficients/cosine_transform.h"
#include "range_decoder.h"

namespace ttsdf {

namespace {

using Eigen::Index;
using Eigen::MatrixXf;

Offsets readOffsets(ByteReader& in) {
  Offsets offsets{};
  for (std::int8_t& offset : offsets) offset = static_cast<std::int8_t>(in.u8());
  return offsets;
}

float readStep(ByteReader& in) {
  const float step = in.f32();
  if (!std::isfinite(step) || step <= 0.0f) {
    refuse(in.what() + ": quantisation step", std::to_string(step), "a positive number");
  }
  return step;
}

void readRangeCoded(ByteReader& in, const std::vector<CoefficientBlock*>& blocks) {
  RangeDecoder stream(in);
  CoefficientModel<RangeDecoder> model(stream);
  for (CoefficientBlock* block : blocks) model.code(*block);
  stream.expectEnd();
}

/// All but the coefficients, which come later in one stream.
QuantizedBasis readBasis(ByteReader& in, int size, int rank) {
  QuantizedBasis basis;
  basis.finest_step = readStep(in);
  basis.offsets = readOffsets(in);
  const std::uint8_t* const coarseness = in.take(static_cast<std::size_t>(rank));
  basis.coarseness.assign(coarseness, coarseness + rank);
  basis.values = CoefficientBlock(size, rank, 1);
  return basis;
}

}  // namespace

MatrixXf QuantizedBasis::decoded() const {
  MatrixXf frequencies(values.extents[1], values.extents[0]);  // transposed: rows are transformed
  std::size_t n = 0;
  for (Index c = 0; c < frequencies.rows(); ++c) {
    const double column_step = step(c);
    for (Index i = 0; i < frequencies.cols(); ++i, ++n) {
      frequencies(c, i) = dequantizeNumber(values.values[n], column_step, offsets);
    }
  }
  return rowsFromFrequencies(frequencies).transpose();
}

MatrixXf QuantizedCores::decodedMiddle() const {
  MatrixXf frequencies(static_cast<Index>(middle.extents[0]) * middle.extents[1], middle.extents[2]);
  for (Index n = 0; n < frequencies.size(); ++n) {
    frequencies.data()[n] = dequantizeNumber(middle.values[static_cast<std::size_t>(n)], step, offsets);
  }
  return rowsFromFrequencies(frequencies);
}

QuantizedCores readQuantized(ByteReader& in, const CoreHeader& header) {
  QuantizedCores cores;
  cores.header = header;
  cores.step = readStep(in);
  cores.offsets = readOffsets(in);
  cores.first = readBasis(in, header.sizes[0], header.rank1);
  cores.last = readBasis(in, header.sizes[2], header.rank2);
  cores.middle = CoefficientBlock(header.rank1, header.rank2, header.sizes[1]);
  const std::vector<CoefficientBlock*> blocks = {&cores.first.values, &cores.middle, &cores.last.values};
  if (header.encoding == Encoding::kQuantizedFirst) {
    readCoefficients(in, blocks);
  } else {
    readRangeCoded(in, blocks);
  }
  in.expectEnd();
  return cores;
}

TensorTrain dequantize(const QuantizedCores& cores) {
  const MatrixXf slices = cores.decodedMiddle();  // the same memory as r1 x (n2 r2)
  const Index columns = static_cast<Index>(cores.header.rank2) * slices.cols();
  return TensorTrain(cores.header.axes, cores.first.decoded(),
                     Eigen::Map<const MatrixXf>(slices.data(), cores.header.rank1, columns),
                     cores.last.decoded().transpose());
}

}  // namespace ttsdf

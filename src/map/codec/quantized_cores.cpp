#include "quantized_cores.h"

#include "cosine_transform.h"

namespace ttsdf {

namespace {

using Eigen::Index;
using Eigen::MatrixXf;

void writeOffsets(const Offsets& offsets, ByteWriter& out) {
  for (const std::int8_t offset : offsets) out.u8(static_cast<std::uint8_t>(offset));
}

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

void writeBasis(const QuantizedBasis& basis, ByteWriter& out) {
  out.f32(basis.finest_step);
  writeOffsets(basis.offsets, out);
  out.bytes(basis.coarseness);
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

void writeQuantized(const QuantizedCores& cores, ByteWriter& out) {
  writeCoreHeader(cores.header, out);
  out.f32(cores.step);
  writeOffsets(cores.offsets, out);
  writeBasis(cores.first, out);
  writeBasis(cores.last, out);
  writeCoefficients({&cores.first.values, &cores.middle, &cores.last.values}, out);
}

QuantizedCores readQuantized(ByteReader& in, const CoreHeader& header) {
  QuantizedCores cores;
  cores.header = header;
  cores.step = readStep(in);
  cores.offsets = readOffsets(in);
  cores.first = readBasis(in, header.sizes[0], header.rank1);
  cores.last = readBasis(in, header.sizes[2], header.rank2);
  cores.middle = CoefficientBlock(header.rank1, header.rank2, header.sizes[1]);
  readCoefficients(in, {&cores.first.values, &cores.middle, &cores.last.values});
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

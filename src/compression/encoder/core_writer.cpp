#include "core_writer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

#include "../../map/codec/coefficients/coefficient_model.h"
#include "core_quantizer.h"
#include "range_encoder.h"

namespace ttsdf {

namespace {

static_assert(sizeof(Eigen::half) == 2, "Eigen::half is its bits");

std::uint16_t bitsOf(Eigen::half value) {
  std::uint16_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  return bits;
}

/// IEEE 754 half precision has no number above this.
constexpr float kMaxHalf = 65504.0f;

CoreHeader headerOf(const TensorTrain& train, Encoding encoding) {
  CoreHeader header;
  header.encoding = encoding;
  header.axes = train.axes();
  header.sizes = train.modeSizes();
  header.rank1 = train.rank1();
  header.rank2 = train.rank2();
  return header;
}

template <typename Visitor>
void forEachCore(const TensorTrain& train, const Visitor& visit) {
  visit(train.first());
  visit(train.middle());
  visit(train.last());
}

void writeFloat32(const TensorTrain& train, ByteWriter& out) {
  forEachCore(train, [&](const Eigen::MatrixXf& core) {
    for (Eigen::Index n = 0; n < core.size(); ++n) out.f32(core.data()[n]);
  });
}

void writeFloat16(const TensorTrain& train, ByteWriter& out) {
  forEachCore(train, [&](const Eigen::MatrixXf& core) {
    if (core.cwiseAbs().maxCoeff() > kMaxHalf) {
      throw std::invalid_argument("float16: got a core entry of " +
                                  std::to_string(core.cwiseAbs().maxCoeff()) + ", wanted at most 65504");
    }
    for (Eigen::Index n = 0; n < core.size(); ++n) {
      out.u16(bitsOf(static_cast<Eigen::half>(core.data()[n])));
    }
  });
}

void writeOffsets(const Offsets& offsets, ByteWriter& out) {
  for (const std::int8_t offset : offsets) out.u8(static_cast<std::uint8_t>(offset));
}

void writeBasis(const QuantizedBasis& basis, ByteWriter& out) {
  out.f32(basis.finest_step);
  writeOffsets(basis.offsets, out);
  out.bytes(basis.coarseness);
}

void writeCoreHeader(const CoreHeader& header, ByteWriter& out) {
  out.u8(static_cast<std::uint8_t>(header.encoding));
  for (const int axis : header.axes) out.u8(static_cast<std::uint8_t>(axis));
  out.u32(static_cast<std::uint32_t>(header.rank1));
  out.u32(static_cast<std::uint32_t>(header.rank2));
}

QuantizedCores quantizeAs(const TensorTrain& train, const EncodeOptions& options, const CoreBudget& budget) {
  const CoreQuantizer quantizer(train);
  if (options.target_bytes > 0) {
    const std::size_t wanted = budget.other_bytes + CoreQuantizer::kSmallestBytes;
    if (options.target_bytes < wanted) {
      throw std::invalid_argument("target_bytes: got " + std::to_string(options.target_bytes) +
                                  ", wanted at least " + std::to_string(wanted));
    }
    return quantizer.toBytes(options.target_bytes - budget.other_bytes);
  }
  if (options.quantization_step > 0.0) return quantizer.toStep(options.quantization_step);
  return quantizer.toRms(options.quantization_rms > 0.0 ? options.quantization_rms : budget.default_rms);
}

}  // namespace

void writeQuantized(const QuantizedCores& cores, ByteWriter& out) {
  writeCoreHeader(cores.header, out);
  out.f32(cores.step);
  writeOffsets(cores.offsets, out);
  writeBasis(cores.first, out);
  writeBasis(cores.last, out);
  RangeEncoder stream(out);
  for (const CoefficientBlock* block : {&cores.first.values, &cores.middle, &cores.last.values}) {
    CoefficientBlock copy = *block;  // the model's view of it may change it
    CoefficientModel<RangeEncoder>(stream).code(copy);
  }
  stream.flush();
}

void writeCores(const TensorTrain& train, const EncodeOptions& options, const CoreBudget& budget,
                ByteWriter& out) {
  const CoreHeader header = headerOf(train, options.encoding);
  const std::string wanted = wantedRanks(header);
  if (!wanted.empty()) {
    throw std::invalid_argument("map: got ranks " + ranksText(header) + ", wanted " + wanted +
                                " (round the train first)");
  }
  for (const double limit : {options.quantization_rms, options.quantization_step}) {
    if (!std::isfinite(limit) || limit < 0.0) {
      throw std::invalid_argument("quantization: got " + std::to_string(limit) +
                                  " m, wanted a finite number >= 0");
    }
  }
  if (options.encoding == Encoding::kQuantized || options.encoding == Encoding::kQuantizedFirst) {
    writeQuantized(quantizeAs(train, options, budget), out);
    return;
  }
  writeCoreHeader(header, out);
  if (options.encoding == Encoding::kFloat16) {
    writeFloat16(train, out);
  } else {
    writeFloat32(train, out);
  }
}

}  // namespace ttsdf

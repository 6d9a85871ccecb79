#include "encoding.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <sstream>

#include "../codec/core_quantizer.h"

namespace ttsdf {

namespace {

/// 256 MB of float: a thousand times the largest map of the paper, and a bound on what a small file can ask
/// for.
constexpr double kMaxParameters = 1 << 26;

/// IEEE 754 half precision has no number above this.
constexpr float kMaxHalf = 65504.0f;

static_assert(sizeof(Eigen::half) == 2, "Eigen::half is its bits");

std::uint16_t bitsOf(Eigen::half value) {
  std::uint16_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  return bits;
}

Eigen::half halfOf(std::uint16_t bits) {
  Eigen::half value;
  std::memcpy(static_cast<void*>(&value), &bits, sizeof(bits));
  return value;
}

CoreHeader headerOf(const TensorTrain& train, Encoding encoding) {
  CoreHeader header;
  header.encoding = encoding;
  header.axes = train.axes();
  header.sizes = train.modeSizes();
  header.rank1 = train.rank1();
  header.rank2 = train.rank2();
  return header;
}

/// Empty if the ranks can be those of a train of these extents, else what they should be.
std::string wantedRanks(const CoreHeader& header) {
  const auto [n1, n2, n3] = header.sizes;
  const double limit1 = std::min<double>(n1, static_cast<double>(n2) * n3);
  const double limit2 = std::min<double>(n3, static_cast<double>(n1) * n2);
  const double r1 = header.rank1, r2 = header.rank2;
  std::ostringstream text;
  text.precision(12);
  if (r1 < 1 || r1 > limit1 || r2 < 1 || r2 > limit2) {
    text << "r1 in 1.." << limit1 << " and r2 in 1.." << limit2 << " for modes of " << n1 << ", " << n2
         << ", " << n3;
  } else if (n1 * r1 + r1 * n2 * r2 + n3 * r2 > kMaxParameters) {
    text << "cores of at most " << kMaxParameters << " numbers";
  }
  return text.str();
}

std::string ranksText(const CoreHeader& header) {
  return std::to_string(header.rank1) + " and " + std::to_string(header.rank2);
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

/// Reads a core number by number; the bytes that must be there were counted before.
template <typename Next>
Eigen::MatrixXf readCore(Eigen::Index rows, Eigen::Index columns, const Next& next) {
  Eigen::MatrixXf core(rows, columns);
  for (Eigen::Index n = 0; n < core.size(); ++n) core.data()[n] = next();
  return core;
}

template <typename Next>
TensorTrain readPlain(ByteReader& in, const CoreHeader& header, std::size_t number_bytes, const Next& next) {
  const std::size_t wanted = header.parameterCount() * number_bytes;
  if (in.remaining() != wanted) {
    refuse(in.what() + ": bytes of the cores", std::to_string(in.remaining()), std::to_string(wanted));
  }
  const auto [n1, n2, n3] = header.sizes;
  Eigen::MatrixXf first = readCore(n1, header.rank1, next);
  Eigen::MatrixXf middle = readCore(header.rank1, static_cast<Eigen::Index>(n2) * header.rank2, next);
  Eigen::MatrixXf last = readCore(header.rank2, n3, next);
  return TensorTrain(header.axes, std::move(first), std::move(middle), std::move(last));
}

}  // namespace

void writeCoreHeader(const CoreHeader& header, ByteWriter& out) {
  out.u8(static_cast<std::uint8_t>(header.encoding));
  for (const int axis : header.axes) out.u8(static_cast<std::uint8_t>(axis));
  out.u32(static_cast<std::uint32_t>(header.rank1));
  out.u32(static_cast<std::uint32_t>(header.rank2));
}

Encoding readEncoding(ByteReader& in) {
  const std::uint8_t encoding = in.u8();
  if (encoding > static_cast<std::uint8_t>(Encoding::kQuantized)) {
    refuse(in.what() + ": encoding", std::to_string(encoding), "0 (float32), 1 (float16) or 2 (quantized)");
  }
  return static_cast<Encoding>(encoding);
}

static CoreHeader readCoreHeader(ByteReader& in, const Dims& dims) {
  CoreHeader header;
  header.encoding = readEncoding(in);
  ModeOrder sorted{};
  for (std::size_t mode = 0; mode < 3; ++mode) sorted[mode] = header.axes[mode] = in.u8();
  std::sort(sorted.begin(), sorted.end());
  if (sorted != ModeOrder{{0, 1, 2}}) {
    refuse(in.what() + ": mode order",
           std::to_string(header.axes[0]) + " " + std::to_string(header.axes[1]) + " " +
               std::to_string(header.axes[2]),
           "a permutation of 0 1 2");
  }
  for (std::size_t mode = 0; mode < 3; ++mode) header.sizes[mode] = dims[header.axes[mode]];
  const std::uint32_t r1 = in.u32(), r2 = in.u32();
  constexpr std::uint32_t kLargest = 1u << 24;
  header.rank1 = static_cast<int>(std::min(r1, kLargest));
  header.rank2 = static_cast<int>(std::min(r2, kLargest));
  const std::string wanted = wantedRanks(header);
  if (!wanted.empty()) refuse(in.what() + ": ranks", ranksText(header), wanted);
  return header;
}

static QuantizedCores quantizeAs(const TensorTrain& train, const EncodeOptions& options,
                                 const CoreBudget& budget) {
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
  if (options.encoding == Encoding::kQuantized) {
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

TensorTrain readCores(ByteReader& in, const Dims& dims) {
  const CoreHeader header = readCoreHeader(in, dims);
  switch (header.encoding) {
    case Encoding::kFloat16:
      return readPlain(in, header, 2, [&] { return static_cast<float>(halfOf(in.u16())); });
    case Encoding::kQuantized:
      return dequantize(readQuantized(in, header));
    case Encoding::kFloat32:
      break;
  }
  return readPlain(in, header, 4, [&] { return in.f32(); });
}

}  // namespace ttsdf

#include "encoding.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <sstream>

#include "../codec/quantized_cores.h"

namespace ttsdf {

namespace {

/// 256 MB of float: a thousand times the largest map of the paper, and a bound on what a small file can ask
/// for.
constexpr double kMaxParameters = 1 << 26;

Eigen::half halfOf(std::uint16_t bits) {
  Eigen::half value;
  std::memcpy(static_cast<void*>(&value), &bits, sizeof(bits));
  return value;
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

Encoding readEncoding(ByteReader& in) {
  const std::uint8_t encoding = in.u8();
  if (encoding > static_cast<std::uint8_t>(Encoding::kQuantized)) {
    refuse(in.what() + ": encoding", std::to_string(encoding),
           "0 (float32), 1 (float16), 2 (quantized-1) or 3 (quantized)");
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

/// Before anything is decoded: as many numbers as the limits and the coded bytes allow.
static void requireBounds(const CoreHeader& header, std::size_t coded, double max_megabytes,
                          const std::string& what) {
  constexpr double kBytesPerNumber = 16.0;  // whole numbers, frequencies, cores: at the same time
  constexpr double kFree = 1 << 16, kNumbersPerByte = 1 << 10;
  const auto numbers = static_cast<double>(header.parameterCount());
  const auto text = [](double n) {
    std::ostringstream out;
    out.precision(12);
    out << n;
    return out.str();
  };
  if (!(numbers * kBytesPerNumber <= 1e6 * max_megabytes)) {
    refuse(what + ": memory of the cores", text(1e-6 * numbers * kBytesPerNumber) + " MB",
           "at most " + text(max_megabytes) + " (max_map_megabytes)");
  }
  if (numbers > kFree + kNumbersPerByte * static_cast<double>(coded)) {
    refuse(what + ": numbers of the cores", text(numbers),
           "at most " + text(kFree + kNumbersPerByte * static_cast<double>(coded)) + " in " +
               std::to_string(coded) + " bytes");
  }
}

TensorTrain readCores(ByteReader& in, const Dims& dims, double max_megabytes) {
  const std::size_t coded = in.remaining();
  const CoreHeader header = readCoreHeader(in, dims);
  requireBounds(header, coded, max_megabytes, in.what());
  switch (header.encoding) {
    case Encoding::kFloat16:
      return readPlain(in, header, 2, [&] { return static_cast<float>(halfOf(in.u16())); });
    case Encoding::kQuantizedFirst:
    case Encoding::kQuantized:
      return dequantize(readQuantized(in, header));
    case Encoding::kFloat32:
      break;
  }
  return readPlain(in, header, 4, [&] { return in.f32(); });
}

}  // namespace ttsdf

#include "ttsdf_localization/signed_field/field_bricks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "../build_steps/parallel.h"
#include "hole_filling.h"

namespace ttsdf {
namespace {

constexpr int kSide = FieldBricks::kSide;
constexpr int kSamples = kSide * kSide * kSide;
constexpr int kLevels = 32766;               // of value; the last bit of a code says whether it is known
constexpr std::uint16_t kLoose = 2 * 32767;  // until fillLoose

/// Places of a sample between the means of two bricks, which sit at the bricks' middles.
struct Span {
  int low, high;
  float share_high;
};
Span spanOf(int sample, int bricks) {
  const float place = (static_cast<float>(sample) + 0.5F) / static_cast<float>(kSide) - 0.5F;
  const int low = static_cast<int>(std::floor(place));
  return {std::clamp(low, 0, bricks - 1), std::clamp(low + 1, 0, bricks - 1),
          place - static_cast<float>(low)};
}

/// The samples of a brick along its first axis, which lie side by side.
inline void decodeRow(const std::uint16_t* __restrict codes, float low, float step, float* __restrict values,
                      std::uint8_t* __restrict known) {
  std::array<float, kSide> row;
  for (std::size_t r = 0; r < kSide; ++r) row[r] = low + step * static_cast<float>(codes[r] >> 1);
  std::copy(row.begin(), row.end(), values);
  if (!known) return;
  std::array<std::uint8_t, kSide> flags;
  for (std::size_t r = 0; r < kSide; ++r) flags[r] = static_cast<std::uint8_t>(codes[r] & 1U);
  std::copy(flags.begin(), flags.end(), known);
}

}  // namespace

FieldBricks::FieldBricks(const Dims& dims, float low, float high) : dims_(dims), low_(low) {
  if (!(dims >= 1).all() || !(low < high)) {
    std::ostringstream text;
    text << "field bricks: got extents " << dims.transpose() << " and values from " << low << " to " << high
         << " m, wanted extents >= 1 and a range";
    throw std::invalid_argument(text.str());
  }
  step_ = (high - low) / static_cast<float>(kLevels);
  bricks_ = (dims + kSide - 1) / kSide;
  const auto count = static_cast<std::size_t>(bricks_[0]) * static_cast<std::size_t>(bricks_[1]) *
                     static_cast<std::size_t>(bricks_[2]);
  samples_.resize(count);
  constant_.assign(count, kLoose);
  means_ = DenseTensor(bricks_);
  all_loose_.assign(count, 1);
}

std::size_t FieldBricks::memoryBytes() const {
  const auto full =
      std::count_if(samples_.begin(), samples_.end(), [](const Brick& b) { return b != nullptr; });
  return samples_.size() * (sizeof(Brick) + sizeof(std::uint16_t)) +
         static_cast<std::size_t>(full) * kSamples * sizeof(std::uint16_t);
}

std::uint16_t FieldBricks::encode(float value, bool known) const {
  const float level = std::clamp((value - low_) / step_ + 0.5F, 0.0F, static_cast<float>(kLevels));
  return static_cast<std::uint16_t>(2 * static_cast<int>(level) + (known ? 1 : 0));
}

std::size_t FieldBricks::brickOffset(const Dims& brick) const {
  return static_cast<std::size_t>(brick[0]) +
         static_cast<std::size_t>(bricks_[0]) *
             (static_cast<std::size_t>(brick[1]) +
              static_cast<std::size_t>(bricks_[1]) * static_cast<std::size_t>(brick[2]));
}

void FieldBricks::store(const Dims& begin, const Dims& size, const Samples& samples) {
  const Dims end = begin + size;
  const auto inside = [&](int a) {
    return begin[a] >= 0 && size[a] >= 1 && end[a] <= dims_[a] && begin[a] % kSide == 0 &&
           (end[a] % kSide == 0 || end[a] == dims_[a]);
  };
  if (!inside(0) || !inside(1) || !inside(2)) {
    std::ostringstream text;
    text << "field bricks: got a box from " << begin.transpose() << " of " << size.transpose()
         << " samples, wanted one of whole bricks inside " << dims_.transpose();
    throw std::invalid_argument(text.str());
  }
  for (int c = begin[2] / kSide; c * kSide < end[2]; ++c) {
    for (int b = begin[1] / kSide; b * kSide < end[1]; ++b) {
      for (int a = begin[0] / kSide; a * kSide < end[0]; ++a) {
        const Dims first = kSide * Dims(a, b, c);
        storeBrick(Dims(a, b, c), (end - first).min(kSide), samples,
                   ((first - begin).cast<std::ptrdiff_t>() * samples.strides).sum());
      }
    }
  }
}

void FieldBricks::storeBrick(const Dims& brick, const Dims& count, const Samples& samples,
                             std::ptrdiff_t start) {
  const auto code_of = [&](std::ptrdiff_t n) {
    return samples.loose[n] && !samples.known[n] ? kLoose : encode(samples.values[n], samples.known[n] != 0);
  };
  std::array<std::uint16_t, kSamples> codes{};
  const std::uint16_t code = code_of(start);
  codes.fill(code);  // beyond the grid's end, too
  bool constant = true;
  float sum = 0.0F;
  int firm = 0;
  for (int k = 0; k < count[2]; ++k) {
    for (int j = 0; j < count[1]; ++j) {
      std::ptrdiff_t n = start + j * samples.strides[1] + k * samples.strides[2];
      std::uint16_t* row = codes.data() + kSide * (j + kSide * k);
      for (int i = 0; i < count[0]; ++i, n += samples.strides[0]) {
        row[i] = code_of(n);
        constant = constant && row[i] == code;
        if (row[i] != kLoose) sum += samples.values[n], ++firm;
      }
    }
  }
  const std::size_t number = brickOffset(brick);
  constant_[number] = code;
  samples_[number] = constant ? nullptr : Brick(new std::uint16_t[kSamples]);
  if (!constant) std::copy(codes.begin(), codes.end(), samples_[number].get());
  all_loose_[number] = firm == 0 ? 1 : 0;
  if (firm > 0) means_.data()[number] = sum / static_cast<float>(firm);
}

void FieldBricks::fillLoose(int threads) {
  fillHoles(means_, all_loose_, threads);
  parallelFor(bricks_[2], threads, [&](int c) {
    for (int b = 0; b < bricks_[1]; ++b) {
      for (int a = 0; a < bricks_[0]; ++a) fillBrick(Dims(a, b, c));
    }
  });
}

void FieldBricks::fillBrick(const Dims& brick) {
  const std::size_t number = brickOffset(brick);
  Brick& samples = samples_[number];
  if (!samples && constant_[number] != kLoose) return;
  std::array<std::uint16_t, kSamples> codes{};
  if (samples) std::copy_n(samples.get(), kSamples, codes.begin());
  if (!samples) codes.fill(kLoose);
  const Dims first = kSide * brick;
  float low = std::numeric_limits<float>::max(), high = -low;
  std::size_t n = 0;
  for (int k = 0; k < kSide; ++k) {
    const Span z = spanOf(first[2] + k, bricks_[2]);
    for (int j = 0; j < kSide; ++j) {
      const Span y = spanOf(first[1] + j, bricks_[1]);
      for (int i = 0; i < kSide; ++i, ++n) {
        if (codes[n] != kLoose) continue;
        const Span x = spanOf(first[0] + i, bricks_[0]);
        const auto along_x = [&](int v, int w) {
          return means_(x.low, v, w) + x.share_high * (means_(x.high, v, w) - means_(x.low, v, w));
        };
        const auto along_xy = [&](int w) {
          return along_x(y.low, w) + y.share_high * (along_x(y.high, w) - along_x(y.low, w));
        };
        const float value = along_xy(z.low) + z.share_high * (along_xy(z.high) - along_xy(z.low));
        low = std::min(low, value), high = std::max(high, value);
        codes[n] = encode(value, false);
      }
    }
  }
  // Nobody asks for more where nothing is known.
  constexpr float kFlatSteps = 256.0F;
  if (!samples && high - low < kFlatSteps * step_) {
    constant_[number] = encode(0.5F * (low + high), false);
    return;
  }
  if (!samples) samples = Brick(new std::uint16_t[kSamples]);
  std::copy(codes.begin(), codes.end(), samples.get());
}

void FieldBricks::readSlab(const Slab& slab, float* values, std::uint8_t* known) const {
  constexpr std::array<int, 3> kStride{1, kSide, kSide * kSide};
  const auto stride = [&](int a) { return kStride[static_cast<std::size_t>(a)]; };
  const int n_rows = dims_[slab.rows], end = slab.begin + slab.size;
  const int row_stride = stride(slab.rows), column_stride = stride(slab.columns);
  Dims brick = Dims::Zero();
  brick[slab.axis] = slab.index / kSide;
  for (int c0 = slab.begin; c0 < end; c0 += kSide) {
    const int c_count = std::min(kSide, end - c0);
    brick[slab.columns] = c0 / kSide;
    for (int r0 = 0; r0 < n_rows; r0 += kSide) {
      const int r_count = std::min(kSide, n_rows - r0);
      brick[slab.rows] = r0 / kSide;
      const std::size_t number = brickOffset(brick);
      const std::uint16_t* samples = samples_[number].get();
      const float constant = decode(constant_[number]);
      const auto constant_known = static_cast<std::uint8_t>(constant_[number] & 1U);
      for (int c = 0; c < c_count; ++c) {
        const std::size_t n =
            static_cast<std::size_t>(c0 - slab.begin + c) * static_cast<std::size_t>(n_rows) +
            static_cast<std::size_t>(r0);
        if (!samples) {
          std::fill_n(values + n, r_count, constant);
          if (known) std::fill_n(known + n, r_count, constant_known);
          continue;
        }
        const std::uint16_t* source = samples + (slab.index % kSide) * stride(slab.axis) + c * column_stride;
        if (slab.rows == 0 && r_count == kSide) {
          decodeRow(source, low_, step_, values + n, known ? known + n : nullptr);
          continue;
        }
        for (int r = 0; r < r_count; ++r)
          values[n + static_cast<std::size_t>(r)] = decode(source[r * row_stride]);
        if (!known) continue;
        for (int r = 0; r < r_count; ++r)
          known[n + static_cast<std::size_t>(r)] = static_cast<std::uint8_t>(source[r * row_stride] & 1U);
      }
    }
  }
}

}  // namespace ttsdf

#include "stored_cores.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "../../tensor/vectorize.h"

#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace ttsdf {

namespace {

constexpr int kPad = 8;  // numbers of a column come in vectors of so many
constexpr float kLargestShort = 32767.0f;

int padded(int n) { return (n + kPad - 1) / kPad * kPad; }

#if defined(__GNUC__)
using Shorts = std::int16_t __attribute__((vector_size(16)));
using Ints = std::int32_t __attribute__((vector_size(32)));
using Floats = float __attribute__((vector_size(32)));
#endif

/// columns[q][b] = sum_a weights[q][a] rows[a][b] for `kVectors` times eight b from `b` on: four columns stay
/// in registers.
template <int kVectors>
inline __attribute__((always_inline)) void contractPart(const float* weights, const std::int16_t* rows,
                                                        int rank, int width, float* columns) {
  Floats sum[kColumnBlock][kVectors] = {};
  for (int a = 0; a < rank; ++a) {
    const std::int16_t* const row = rows + static_cast<std::ptrdiff_t>(a) * width;
    Floats values[kVectors];
    for (int v = 0; v < kVectors; ++v) {
      Shorts shorts;
      __builtin_memcpy(&shorts, row + kPad * v, sizeof(shorts));
      values[v] = __builtin_convertvector(__builtin_convertvector(shorts, Ints), Floats);
    }
    for (int q = 0; q < kColumnBlock; ++q) {
      for (int v = 0; v < kVectors; ++v) sum[q][v] += weights[kColumnBlock * a + q] * values[v];
    }
  }
  for (int q = 0; q < kColumnBlock; ++q)
    __builtin_memcpy(columns + static_cast<std::ptrdiff_t>(q) * width, sum[q], sizeof(sum[q]));
}

TTSDF_VECTORIZE void contractColumns(const float* weights, const std::int16_t* rows, int rank, int width,
                                     float* columns) {
  int b = 0;
  for (; b + 2 * kPad <= width; b += 2 * kPad) contractPart<2>(weights, rows + b, rank, width, columns + b);
  if (b < width) contractPart<1>(weights, rows + b, rank, width, columns + b);
}

TTSDF_VECTORIZE void toShorts(const float* values, int size, float factor, std::int16_t* out) {
  for (int n = 0; n < size; ++n) {
    const float scaled = values[n] * factor;
    out[n] = static_cast<std::int16_t>(static_cast<std::int32_t>(scaled + (scaled < 0.0f ? -0.5f : 0.5f)));
  }
}

/// Magnitudes of finite floats are in the order of their bits, and whole numbers have a vector maximum.
TTSDF_VECTORIZE float largestOf(const float* values, int size) {
  std::int32_t largest = 0;
  for (int n = 0; n < size; ++n) {
    std::int32_t raw = 0;
    __builtin_memcpy(&raw, values + n, sizeof(raw));
    raw &= 0x7fffffff;
    largest = raw > largest ? raw : largest;
  }
  float result = 0.0f;
  __builtin_memcpy(&result, &largest, sizeof(result));
  return result;
}

/// Numbers and their scale: values = scale * numbers, the largest number `limit`.
float quantize(const float* values, int size, float limit, std::int16_t* numbers) {
  const float largest = largestOf(values, size);
  const bool usable = largest > 1e-30f;
  toShorts(values, size, usable ? limit / largest : 0.0f, numbers);
  return usable ? largest / limit : 0.0f;
}

}  // namespace

#ifdef __SSE2__

namespace {

using DotProducts = void (*)(const std::int16_t* const[4], const std::int16_t* const[2], int,
                             std::int32_t (*)[4]);

/// The four sums of four vectors.
__m128i sumsOf(__m128i a, __m128i b, __m128i c, __m128i d) {
  const __m128i ab = _mm_add_epi32(_mm_unpacklo_epi32(a, b), _mm_unpackhi_epi32(a, b));
  const __m128i cd = _mm_add_epi32(_mm_unpacklo_epi32(c, d), _mm_unpackhi_epi32(c, d));
  return _mm_add_epi32(_mm_unpacklo_epi64(ab, cd), _mm_unpackhi_epi64(ab, cd));
}

void storeSums(const __m128i (*sum)[4], std::int32_t (*out)[4]) {
  for (int r = 0; r < 2; ++r) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out[r]), sumsOf(sum[r][0], sum[r][1], sum[r][2], sum[r][3]));
  }
}

inline const __m128i* eight(const std::int16_t* numbers) { return reinterpret_cast<const __m128i*>(numbers); }

/// What every x86-64 can do.
void dotsSse2(const std::int16_t* const columns[4], const std::int16_t* const rows[2], int width,
              std::int32_t (*out)[4]) {
  __m128i sum[2][4] = {};
  for (int b = 0; b < width; b += kPad) {
    const __m128i row0 = _mm_loadu_si128(eight(rows[0] + b)), row1 = _mm_loadu_si128(eight(rows[1] + b));
    for (int q = 0; q < 4; ++q) {
      const __m128i column = _mm_loadu_si128(eight(columns[q] + b));
      sum[0][q] = _mm_add_epi32(sum[0][q], _mm_madd_epi16(column, row0));
      sum[1][q] = _mm_add_epi32(sum[1][q], _mm_madd_epi16(column, row1));
    }
  }
  storeSums(sum, out);
}

__attribute__((target("avx2"))) void dotsAvx2(const std::int16_t* const columns[4],
                                              const std::int16_t* const rows[2], int width,
                                              std::int32_t (*out)[4]) {
  __m256i wide[2][4] = {};
  int b = 0;
  for (; b + 2 * kPad <= width; b += 2 * kPad) {
    const __m256i row0 = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(rows[0] + b)),
                  row1 = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(rows[1] + b));
    for (int q = 0; q < 4; ++q) {
      const __m256i column = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(columns[q] + b));
      wide[0][q] = _mm256_add_epi32(wide[0][q], _mm256_madd_epi16(column, row0));
      wide[1][q] = _mm256_add_epi32(wide[1][q], _mm256_madd_epi16(column, row1));
    }
  }
  __m128i sum[2][4];
  for (int q = 0; q < 4; ++q) {
    for (int r = 0; r < 2; ++r) {
      sum[r][q] = _mm_add_epi32(_mm256_castsi256_si128(wide[r][q]), _mm256_extracti128_si256(wide[r][q], 1));
      if (b == width) continue;
      const __m128i column = _mm_loadu_si128(eight(columns[q] + b)),
                    row = _mm_loadu_si128(eight(rows[r] + b));
      sum[r][q] = _mm_add_epi32(sum[r][q], _mm_madd_epi16(column, row));
    }
  }
  for (int r = 0; r < 2; ++r) {
    const __m128i a = sum[r][0], c = sum[r][1], d = sum[r][2], e = sum[r][3];
    const __m128i ac = _mm_hadd_epi32(a, c), de = _mm_hadd_epi32(d, e);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out[r]), _mm_hadd_epi32(ac, de));
  }
}

const DotProducts kDots = __builtin_cpu_supports("avx2") ? dotsAvx2 : dotsSse2;

using DotsTogether = void (*)(const std::int16_t* const[4], const std::int32_t (*)[kRowsTogether], int,
                              std::int32_t (*)[kRowsTogether]);

std::int32_t pairAt(const std::int16_t* numbers) {
  std::int32_t pair;
  std::memcpy(&pair, numbers, sizeof(pair));
  return pair;
}

/// Rows side by side: no sum runs across a vector.
void togetherSse2(const std::int16_t* const columns[4], const std::int32_t (*pairs)[kRowsTogether], int width,
                  std::int32_t (*out)[kRowsTogether]) {
  __m128i sum[4][2] = {};
  for (int n = 0; n < width / 2; ++n) {
    const auto* const rows = reinterpret_cast<const __m128i*>(pairs[n]);
    const __m128i row0 = _mm_loadu_si128(rows), row1 = _mm_loadu_si128(rows + 1);
    for (int q = 0; q < 4; ++q) {
      const __m128i column = _mm_set1_epi32(pairAt(columns[q] + 2 * n));
      sum[q][0] = _mm_add_epi32(sum[q][0], _mm_madd_epi16(column, row0));
      sum[q][1] = _mm_add_epi32(sum[q][1], _mm_madd_epi16(column, row1));
    }
  }
  for (int q = 0; q < 4; ++q) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out[q]), sum[q][0]);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out[q]) + 1, sum[q][1]);
  }
}

__attribute__((target("avx2"))) void togetherAvx2(const std::int16_t* const columns[4],
                                                  const std::int32_t (*pairs)[kRowsTogether], int width,
                                                  std::int32_t (*out)[kRowsTogether]) {
  __m256i sum[4] = {};
  for (int n = 0; n < width / 2; ++n) {
    const __m256i rows = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(pairs[n]));
    for (int q = 0; q < 4; ++q) {
      const __m256i column = _mm256_set1_epi32(pairAt(columns[q] + 2 * n));
      sum[q] = _mm256_add_epi32(sum[q], _mm256_madd_epi16(column, rows));
    }
  }
  for (int q = 0; q < 4; ++q) _mm256_storeu_si256(reinterpret_cast<__m256i*>(out[q]), sum[q]);
}

const DotsTogether kTogether = __builtin_cpu_supports("avx2") ? togetherAvx2 : togetherSse2;

}  // namespace

void dotProducts(const std::int16_t* const columns[4], const std::int16_t* const rows[2], int width,
                 std::int32_t (*out)[4]) {
  kDots(columns, rows, width, out);
}

void dotProducts(const std::int16_t* const columns[4], const std::int32_t (*pairs)[kRowsTogether], int width,
                 std::int32_t (*out)[kRowsTogether]) {
  kTogether(columns, pairs, width, out);
}

#else

void dotProducts(const std::int16_t* const columns[4], const std::int16_t* const rows[2], int width,
                 std::int32_t (*out)[4]) {
  for (int r = 0; r < 2; ++r) {
    for (int q = 0; q < 4; ++q) {
      std::int32_t sum = 0;
      for (int b = 0; b < width; ++b)
        sum += static_cast<std::int32_t>(columns[q][b]) * static_cast<std::int32_t>(rows[r][b]);
      out[r][q] = sum;
    }
  }
}

void dotProducts(const std::int16_t* const columns[4], const std::int32_t (*pairs)[kRowsTogether], int width,
                 std::int32_t (*out)[kRowsTogether]) {
  for (int q = 0; q < 4; ++q) {
    for (int m = 0; m < kRowsTogether; ++m) {
      std::int32_t sum = 0;
      for (int n = 0; n < width / 2; ++n) {
        std::int16_t row[2];
        std::memcpy(row, &pairs[n][m], sizeof(row));
        sum += static_cast<std::int32_t>(columns[q][2 * n]) * static_cast<std::int32_t>(row[0]) +
               static_cast<std::int32_t>(columns[q][2 * n + 1]) * static_cast<std::int32_t>(row[1]);
      }
      out[q][m] = sum;
    }
  }
}

#endif

StoredCores::StoredCores(const TensorTrain& train)
    : axes_(train.axes()),
      sizes_(train.modeSizes()),
      rank1_(train.rank1()),
      rank2_(train.rank2()),
      width_(padded(train.rank2())) {
  largest_ = std::min(kLargestShort, std::floor(std::sqrt(2147483000.0f / static_cast<float>(width_))));
  const auto width = static_cast<std::size_t>(width_), rank1 = static_cast<std::size_t>(rank1_);
  // Components of very different size share the numbers of a row fairly once the last core's rows are of
  // length one: what they carry is then in the middle core.
  Eigen::VectorXf norms = train.last().rowwise().norm();
  norms = (norms.array() > 1e-30f).select(norms, 1.0f);

  first_.resize(static_cast<std::size_t>(sizes_[0]) * rank1);
  for (int i = 0; i < sizes_[0]; ++i) {
    for (int a = 0; a < rank1_; ++a)
      first_[static_cast<std::size_t>(i) * rank1 + static_cast<std::size_t>(a)] = train.first()(i, a);
  }
  std::vector<float> row(width);
  middle_.assign(static_cast<std::size_t>(sizes_[1]) * rank1 * width, 0);
  middle_scale_.resize(static_cast<std::size_t>(sizes_[1]) * rank1);
  for (int j = 0; j < sizes_[1]; ++j) {
    const auto slice = train.slice(j);
    for (int a = 0; a < rank1_; ++a) {
      for (int b = 0; b < rank2_; ++b) row[static_cast<std::size_t>(b)] = slice(a, b) * norms[b];
      const std::size_t n = static_cast<std::size_t>(j) * rank1 + static_cast<std::size_t>(a);
      middle_scale_[n] = quantize(row.data(), width_, kLargestShort, &middle_[n * width]);
    }
  }
  last_.assign(static_cast<std::size_t>(sizes_[2]) * width, 0);
  last_scale_.resize(static_cast<std::size_t>(sizes_[2]));
  for (int k = 0; k < sizes_[2]; ++k) {
    for (int b = 0; b < rank2_; ++b) row[static_cast<std::size_t>(b)] = train.last()(b, k) / norms[b];
    last_scale_[static_cast<std::size_t>(k)] =
        quantize(row.data(), width_, largest_, &last_[static_cast<std::size_t>(k) * width]);
  }
}

void StoredCores::contract(int a, int j, float* scale, std::int16_t* numbers) const {
  static thread_local std::vector<float> weights, columns;
  weights.resize(static_cast<std::size_t>(kColumnBlock * rank1_));
  columns.resize(static_cast<std::size_t>(kColumnBlock * width_));
  const float* const scales = &middle_scale_[static_cast<std::size_t>(j) * static_cast<std::size_t>(rank1_)];
  for (int q = 0; q < kColumnBlock; ++q) {
    const int i = std::min(kColumnBlock * a + q, sizes_[0] - 1);
    const float* const first = &first_[static_cast<std::size_t>(i) * static_cast<std::size_t>(rank1_)];
    for (int r = 0; r < rank1_; ++r)
      weights[static_cast<std::size_t>(kColumnBlock * r + q)] = first[r] * scales[r];
  }
  contractColumns(weights.data(),
                  &middle_[static_cast<std::size_t>(j) * static_cast<std::size_t>(rank1_) *
                           static_cast<std::size_t>(width_)],
                  rank1_, width_, columns.data());
  for (int q = 0; q < kColumnBlock; ++q) {
    scale[q] = quantize(&columns[static_cast<std::size_t>(q * width_)], width_, largest_,
                        numbers + static_cast<std::ptrdiff_t>(q) * width_);
  }
}

void StoredCores::rowsTogether(int k, std::int32_t (*pairs)[kRowsTogether], float* scale) const {
  for (int m = 0; m < kRowsTogether; ++m) {
    const int at = std::min(k + m, sizes_[2] - 1);
    scale[m] = lastScale(at);
    const std::int16_t* const row = last(at);
    for (int n = 0; n < width_ / 2; ++n) std::memcpy(&pairs[n][m], row + 2 * n, sizeof(pairs[n][m]));
  }
}

std::size_t StoredCores::memoryBytes() const {
  return (first_.size() + middle_scale_.size() + last_scale_.size()) * sizeof(float) +
         (middle_.size() + last_.size()) * sizeof(std::int16_t);
}

}  // namespace ttsdf

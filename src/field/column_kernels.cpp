#include "column_kernels.h"

#if defined(__x86_64__) && defined(__GNUC__)
#define TTSDF_X86 1
// GCC 12 warns inside its own AVX-512 header (GCC bug 105593).
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#include <immintrin.h>
#pragma GCC diagnostic pop
#endif

namespace ttsdf {

namespace {

void contractPortable(const float* g, int stride_g, const float* slice, int r1, int width, float* c) {
  for (int n = 0; n < kColumnBlock * width; ++n) c[n] = 0.0f;
  for (int a = 0; a < r1; ++a) {
    const float* const row = slice + a * width;
    for (int q = 0; q < kColumnBlock; ++q) {
      const float weight = g[q * stride_g + a];
      for (int b = 0; b < width; ++b) c[q * width + b] += weight * row[b];
    }
  }
}

void dotsPortable(const float* const columns[4], const float* const last[2], int width, float* out) {
  // Sixteen partial sums per product, as wide vectors would keep: the same rounding to a few ulp.
  for (int n = 0; n < 8; ++n) {
    const float* const c = columns[n & 3];
    const float* const l = last[n >> 2];
    float partial[kColumnPad] = {};
    for (int b = 0; b < width; b += kColumnPad) {
      for (int t = 0; t < kColumnPad; ++t) partial[t] += c[b + t] * l[b + t];
    }
    float sum = 0.0f;
    for (int t = 0; t < kColumnPad; ++t) sum += partial[t];
    out[n] = sum;
  }
}

#ifdef TTSDF_X86

#define TTSDF_AVX2 __attribute__((target("avx2,fma")))
#define TTSDF_AVX512 __attribute__((target("avx512f,avx512dq,avx2,fma")))

TTSDF_AVX2 void contractAvx2(const float* g, int stride_g, const float* slice, int r1, int width, float* c) {
  for (int b = 0; b < width; b += 16) {  // 4 columns x 16 floats stay in 8 registers
    __m256 acc[kColumnBlock][2];
    for (auto& row : acc) row[0] = row[1] = _mm256_setzero_ps();
    for (int a = 0; a < r1; ++a) {
      const __m256 s0 = _mm256_loadu_ps(slice + a * width + b),
                   s1 = _mm256_loadu_ps(slice + a * width + b + 8);
      for (int q = 0; q < kColumnBlock; ++q) {
        const __m256 w = _mm256_broadcast_ss(g + q * stride_g + a);
        acc[q][0] = _mm256_fmadd_ps(w, s0, acc[q][0]);
        acc[q][1] = _mm256_fmadd_ps(w, s1, acc[q][1]);
      }
    }
    for (int q = 0; q < kColumnBlock; ++q) {
      _mm256_storeu_ps(c + q * width + b, acc[q][0]);
      _mm256_storeu_ps(c + q * width + b + 8, acc[q][1]);
    }
  }
}

/// Eight vectors to the vector of their eight sums.
TTSDF_AVX2 inline __m256 sumEight(const __m256* v) {
  const __m256 h0 = _mm256_hadd_ps(v[0], v[1]), h1 = _mm256_hadd_ps(v[2], v[3]);
  const __m256 h2 = _mm256_hadd_ps(v[4], v[5]), h3 = _mm256_hadd_ps(v[6], v[7]);
  const __m256 q0 = _mm256_hadd_ps(h0, h1), q1 = _mm256_hadd_ps(h2, h3);
  return _mm256_add_ps(_mm256_permute2f128_ps(q0, q1, 0x20), _mm256_permute2f128_ps(q0, q1, 0x31));
}

TTSDF_AVX2 void dotsAvx2(const float* const columns[4], const float* const last[2], int width, float* out) {
  __m256 acc[8];
  for (auto& a : acc) a = _mm256_setzero_ps();
  for (int b = 0; b < width; b += 8) {
    const __m256 l0 = _mm256_loadu_ps(last[0] + b), l1 = _mm256_loadu_ps(last[1] + b);
    for (int q = 0; q < 4; ++q) {
      const __m256 c = _mm256_loadu_ps(columns[q] + b);
      acc[q] = _mm256_fmadd_ps(c, l0, acc[q]);
      acc[q + 4] = _mm256_fmadd_ps(c, l1, acc[q + 4]);
    }
  }
  _mm256_storeu_ps(out, sumEight(acc));
}

TTSDF_AVX512 void contractAvx512(const float* g, int stride_g, const float* slice, int r1, int width,
                                 float* c) {
  for (int b = 0; b < width; b += 16) {
    __m512 acc[kColumnBlock];
    for (auto& row : acc) row = _mm512_setzero_ps();
    for (int a = 0; a < r1; ++a) {
      const __m512 s = _mm512_loadu_ps(slice + a * width + b);
      for (int q = 0; q < kColumnBlock; ++q) {
        acc[q] = _mm512_fmadd_ps(_mm512_set1_ps(g[q * stride_g + a]), s, acc[q]);
      }
    }
    for (int q = 0; q < kColumnBlock; ++q) _mm512_storeu_ps(c + q * width + b, acc[q]);
  }
}

TTSDF_AVX512 void dotsAvx512(const float* const columns[4], const float* const last[2], int width,
                             float* out) {
  __m512 acc[8];
  for (auto& a : acc) a = _mm512_setzero_ps();
  for (int b = 0; b < width; b += 16) {
    const __m512 l0 = _mm512_loadu_ps(last[0] + b), l1 = _mm512_loadu_ps(last[1] + b);
    for (int q = 0; q < 4; ++q) {
      const __m512 c = _mm512_loadu_ps(columns[q] + b);
      acc[q] = _mm512_fmadd_ps(c, l0, acc[q]);
      acc[q + 4] = _mm512_fmadd_ps(c, l1, acc[q + 4]);
    }
  }
  __m256 halves[8];
  for (int q = 0; q < 8; ++q) {
    halves[q] = _mm256_add_ps(_mm512_castps512_ps256(acc[q]), _mm512_extractf32x8_ps(acc[q], 1));
  }
  const __m256 h0 = _mm256_hadd_ps(halves[0], halves[1]), h1 = _mm256_hadd_ps(halves[2], halves[3]);
  const __m256 h2 = _mm256_hadd_ps(halves[4], halves[5]), h3 = _mm256_hadd_ps(halves[6], halves[7]);
  const __m256 q0 = _mm256_hadd_ps(h0, h1), q1 = _mm256_hadd_ps(h2, h3);
  _mm256_storeu_ps(out,
                   _mm256_add_ps(_mm256_permute2f128_ps(q0, q1, 0x20), _mm256_permute2f128_ps(q0, q1, 0x31)));
}

#endif  // TTSDF_X86

std::vector<ColumnKernels> detectKernels() {
  std::vector<ColumnKernels> kernels;
#ifdef TTSDF_X86
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) {
    kernels.push_back({contractAvx512, dotsAvx512, "avx512"});
  }
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    kernels.push_back({contractAvx2, dotsAvx2, "avx2"});
  }
#endif
  kernels.push_back({contractPortable, dotsPortable, "portable"});
  return kernels;
}

}  // namespace

const std::vector<ColumnKernels>& availableColumnKernels() {
  static const std::vector<ColumnKernels> kernels = detectKernels();
  return kernels;
}

const ColumnKernels& columnKernels(bool portable) {
  return portable ? availableColumnKernels().back() : availableColumnKernels().front();
}

}  // namespace ttsdf

// How near the contraction of the tensor train comes to what this machine can do: the peak of multiply-adds
// that never leave the registers, measured here, against the kernels of the compressed field.
#include <benchmark/benchmark.h>

#include <string>
#include <vector>

#include "../src/field/column_kernels.h"

namespace {

constexpr int kChains = 12;  // independent sums: more than latency times units, fewer than registers
constexpr int kRounds = 1000;

struct Floats4 {
  using Vector = float __attribute__((vector_size(16)));
  static constexpr int kWidth = 4;
};
struct Floats8 {
  using Vector = float __attribute__((vector_size(32)));
  static constexpr int kWidth = 8;
};
struct Floats16 {
  using Vector = float __attribute__((vector_size(64)));
  static constexpr int kWidth = 16;
};

/// kChains vectors, kRounds times multiplied and added to.
template <class Floats>
__attribute__((always_inline)) inline float chains(float factor, float term) {
  using Vector = typename Floats::Vector;
  const Vector a = Vector{} + factor, b = Vector{} + term;
  Vector s[kChains];
  for (int c = 0; c < kChains; ++c) s[c] = b + static_cast<float>(c);
  for (int n = 0; n < kRounds; ++n) {
    for (Vector& sum : s) sum = sum * a + b;
  }
  for (int c = 1; c < kChains; ++c) s[0] += s[c];
  float total = 0.0f;
  for (int n = 0; n < Floats::kWidth; ++n) total += s[0][n];
  return total;
}

using Chains = float (*)(float, float);
#if defined(__x86_64__) && defined(__GNUC__)
#define TTSDF_PEAK(TARGET) __attribute__((target(TARGET), optimize("O3")))
TTSDF_PEAK("avx512f,avx512dq,avx2,fma") float chainsAvx512(float a, float b) {
  return chains<Floats16>(a, b);
}
TTSDF_PEAK("avx2,fma") float chainsAvx2(float a, float b) { return chains<Floats8>(a, b); }
#endif
float chainsPortable(float a, float b) { return chains<Floats4>(a, b); }

struct Peak {
  Chains run;
  int width;
};
Peak peakOf(const std::string& kernel) {
#if defined(__x86_64__) && defined(__GNUC__)
  if (kernel == "avx512") return {chainsAvx512, 16};
  if (kernel == "avx2") return {chainsAvx2, 8};
#endif
  return {chainsPortable, 4};
}

/// Multiplications and additions of one call as a rate.
void reportFlops(benchmark::State& state, double flops_per_call) {
  state.counters["flops"] = benchmark::Counter(flops_per_call * static_cast<double>(state.iterations()),
                                               benchmark::Counter::kIsRate);
  state.SetLabel(ttsdf::columnKernels().name);
}

void peak(benchmark::State& state) {
  const Peak peak = peakOf(ttsdf::columnKernels().name);
  float factor = 0.5f, term = 1.0f;
  for (auto _ : state) {
    benchmark::DoNotOptimize(factor);
    benchmark::DoNotOptimize(peak.run(factor, term));
  }
  reportFlops(state, 2.0 * kChains * kRounds * peak.width);
}
BENCHMARK(peak);

int padded(int rank) { return (rank + ttsdf::kColumnPad - 1) / ttsdf::kColumnPad * ttsdf::kColumnPad; }

/// Columns G1(i, :) G2(:, j, :) over a whole middle core of 150 slices, as a map's first scans need them.
/// What padding adds is not counted as work.
void contraction(benchmark::State& state) {
  constexpr int kSlices = 150;
  const int rank = static_cast<int>(state.range(0)), width = padded(rank);
  const std::vector<float> first(static_cast<std::size_t>(ttsdf::kColumnBlock * rank), 0.5f);
  const std::vector<float> middle(static_cast<std::size_t>(kSlices * rank * width), 0.25f);
  std::vector<float> columns(static_cast<std::size_t>(ttsdf::kColumnBlock * width));
  for (auto _ : state) {
    for (int j = 0; j < kSlices; ++j) {
      ttsdf::columnKernels().contract(first.data(), rank, middle.data() + j * rank * width, rank, width,
                                      columns.data());
      benchmark::DoNotOptimize(columns.data());
      benchmark::ClobberMemory();
    }
  }
  reportFlops(state, 2.0 * kSlices * ttsdf::kColumnBlock * rank * rank);
}
BENCHMARK(contraction)->ArgName("rank")->Arg(16)->Arg(32)->Arg(40)->Arg(64)->Arg(80);

}  // namespace

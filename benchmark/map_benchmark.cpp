// Making and storing a map: fusion of depth frames, decomposition, recompression, encoding and decoding.
#include <benchmark/benchmark.h>

#include "benchmark_world.h"
#include "ttsdf_localization/compression/map_writer.h"
#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/fusion/tsdf_volume.h"

namespace {

ttsdf::TtSvdOptions rankCap(int rank) {
  ttsdf::TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = rank;
  return options;
}

void ttSvdOfTheArray(benchmark::State& state) {
  const auto& array = ttsdf::benchmarkArray();
  for (auto _ : state)
    benchmark::DoNotOptimize(ttsdf::ttSvd(array, rankCap(static_cast<int>(state.range(0)))));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(array.size()));
}
BENCHMARK(ttSvdOfTheArray)->ArgName("rank")->Arg(20)->Arg(40)->Arg(80)->Unit(benchmark::kMillisecond);

// Cubes of growing side: the theory says n^4 for the Gram matrices.
void ttSvdOfACube(benchmark::State& state) {
  const int side = static_cast<int>(state.range(0));
  ttsdf::DenseTensor cube(ttsdf::Dims(side, side, side));
  for (int k = 0; k < side; ++k) {
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        cube(i, j, k) = static_cast<float>(Eigen::Vector3d(i, j, k).norm() / side);
      }
    }
  }
  for (auto _ : state) benchmark::DoNotOptimize(ttsdf::ttSvd(cube, rankCap(20)));
  state.SetComplexityN(side);
}
BENCHMARK(ttSvdOfACube)->RangeMultiplier(2)->Range(32, 256)->Unit(benchmark::kMillisecond)->Complexity();

void roundToHalfTheRank(benchmark::State& state) {
  const auto& train = ttsdf::benchmarkTrain(80);
  for (auto _ : state) benchmark::DoNotOptimize(ttsdf::round(train, rankCap(40)));
}
BENCHMARK(roundToHalfTheRank)->Unit(benchmark::kMillisecond);

void fuseFrame(benchmark::State& state) {
  ttsdf::FusionOptions options;
  options.threads = static_cast<int>(state.range(0));
  ttsdf::TsdfVolume volume(options);
  const auto& scan = ttsdf::benchmarkScan();
  for (auto _ : state) volume.integrate(scan.image, scan.intrinsics, scan.T_map_sensor);
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(fuseFrame)->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

ttsdf::TtSdfMap benchmarkMap() {
  ttsdf::TtSdfMap map;
  map.train = ttsdf::benchmarkTrain(40);
  map.geometry = ttsdf::benchmarkGeometry();
  map.truncation = 0.06;
  return map;
}

void encode(benchmark::State& state, ttsdf::Encoding encoding) {
  const auto map = benchmarkMap();
  ttsdf::EncodeOptions options;
  options.encoding = encoding;
  std::size_t bytes = 0;
  for (auto _ : state) bytes = ttsdf::serialize(map, options).size();
  state.counters["file_bytes"] = static_cast<double>(bytes);
}
BENCHMARK_CAPTURE(encode, float32, ttsdf::Encoding::kFloat32)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(encode, float16, ttsdf::Encoding::kFloat16)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(encode, quantized, ttsdf::Encoding::kQuantized)->Unit(benchmark::kMillisecond);

void decode(benchmark::State& state, ttsdf::Encoding encoding) {
  ttsdf::EncodeOptions options;
  options.encoding = encoding;
  const auto bytes = ttsdf::serialize(benchmarkMap(), options);
  for (auto _ : state) benchmark::DoNotOptimize(ttsdf::deserialize(bytes.data(), bytes.size()));
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes.size()));
}
BENCHMARK_CAPTURE(decode, float32, ttsdf::Encoding::kFloat32)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(decode, float16, ttsdf::Encoding::kFloat16)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(decode, quantized, ttsdf::Encoding::kQuantized)->Unit(benchmark::kMillisecond);

}  // namespace

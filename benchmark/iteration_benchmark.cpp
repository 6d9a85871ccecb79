// What an iteration of the registration costs, all included (transform, field, residuals, normal equations,
// step): over the number of points, the rank and the size of the map. And what the first scan after loading
// costs.
#include <benchmark/benchmark.h>

#include <algorithm>

#include "../src/registration/solver/minimizer.h"
#include "benchmark_world.h"
#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/field/tt_distance_field.h"
#include "ttsdf_localization/simulation/scene_sampling.h"

namespace {

using ttsdf::Interpolation;
using FieldPtr = std::shared_ptr<const ttsdf::DistanceField>;

constexpr int kRank = 40;
constexpr double kMove = 0.05;  // [m] of the prior

Eigen::Isometry3d movedPrior(double distance) {
  Eigen::Isometry3d T = ttsdf::benchmarkScan().T_map_sensor;
  T.translate(distance * Eigen::Vector3d(1.0, -2.0, 2.0).normalized());
  return T;
}

ttsdf::ScanPoints scanOfStride(int stride) {
  const auto& scan = ttsdf::benchmarkScan();
  return ttsdf::toPoints(scan.image, scan.intrinsics, stride, 0.2, 4.0);
}

/// The last stage of a registration over all points, to the end.
void iterate(benchmark::State& state, const FieldPtr& field, const ttsdf::ScanPoints& points) {
  ttsdf::ScanBuffer scan;
  scan.assign(points, static_cast<int>(points.cols()));
  ttsdf::StageOptions stage;
  stage.points = scan.size();
  stage.model.check_facing = true;
  const auto prior = movedPrior(kMove);
  ttsdf::StageResult result = levenbergMarquardt(*field, scan, prior, stage);  // fills the caches
  for (auto _ : state) benchmark::DoNotOptimize(result = levenbergMarquardt(*field, scan, prior, stage));
  const double evaluations = static_cast<double>(result.iterations) * scan.size();
  state.counters["points"] = scan.size();
  state.counters["iterations"] = result.iterations;
  state.counters["s_per_point_and_iteration"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * evaluations,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void overRank(benchmark::State& state) {
  iterate(state, ttsdf::benchmarkTrainField(static_cast<int>(state.range(0)), Interpolation::kTrilinear),
          scanOfStride(8));
}
BENCHMARK(overRank)->ArgName("rank")->Arg(10)->Arg(20)->Arg(40)->Arg(60)->Arg(80)->Repetitions(5);

void dense(benchmark::State& state) { iterate(state, ttsdf::benchmarkDenseField(), scanOfStride(8)); }
BENCHMARK(dense)->Repetitions(5);

void overPoints(benchmark::State& state) {
  iterate(state, ttsdf::benchmarkTrainField(kRank, Interpolation::kTrilinear),
          scanOfStride(static_cast<int>(state.range(0))));
}
BENCHMARK(overPoints)->ArgName("stride")->Arg(32)->Arg(16)->Arg(8)->Arg(4)->Arg(2)->Repetitions(5);

void denseOverPoints(benchmark::State& state) {
  iterate(state, ttsdf::benchmarkDenseField(), scanOfStride(static_cast<int>(state.range(0))));
}
BENCHMARK(denseOverPoints)->ArgName("stride")->Arg(32)->Arg(16)->Arg(8)->Arg(4)->Arg(2)->Repetitions(5);

/// The same place at other voxel sizes.
ttsdf::DenseTensor arrayOf(const ttsdf::GridGeometry& geometry) {
  ttsdf::DenseTensor array = sampleDistances(ttsdf::benchmarkScene(), geometry);
  for (std::size_t n = 0; n < array.size(); ++n) array.data()[n] = std::clamp(array.data()[n], -0.06f, 0.2f);
  return array;
}

void overMapSize(benchmark::State& state, bool compressed) {
  ttsdf::GridGeometry geometry = ttsdf::benchmarkGeometry();
  const double finer = 20.0 / static_cast<double>(state.range(0));
  geometry.voxel_size /= finer;
  geometry.dims = (finer * geometry.dims.cast<double>()).cast<int>();
  const ttsdf::DenseTensor array = arrayOf(geometry);
  state.counters["voxels"] = static_cast<double>(array.size());
  ttsdf::TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = kRank;
  const FieldPtr field =
      compressed ? FieldPtr(std::make_shared<ttsdf::TtDistanceField>(ttSvd(array, options).train, geometry))
                 : std::make_shared<ttsdf::DenseDistanceField>(array, geometry);
  iterate(state, field, scanOfStride(8));
}
BENCHMARK_CAPTURE(overMapSize, compressed, true)->ArgName("mm")->Arg(80)->Arg(40)->Arg(20)->Arg(14);
BENCHMARK_CAPTURE(overMapSize, dense, false)->ArgName("mm")->Arg(80)->Arg(40)->Arg(20)->Arg(14);

/// Pushes everything out of the processor's caches.
void forgetCaches() {
  static std::vector<char> other(std::size_t{256} << 20);
  for (std::size_t n = 0; n < other.size(); n += 64) ++other[n];
  benchmark::DoNotOptimize(other.data());
}

enum class Start { kWarm, kFirst, kFirstCold };

/// A whole registration from 0.1 m: again and again (kWarm); the first one after a map was made ready
/// (kFirst); that with nothing left in the processor's caches, as after a long pause (kFirstCold).
void scan(benchmark::State& state, Start start) {
  const auto& points = ttsdf::benchmarkScan().points;
  const auto prior = movedPrior(0.1);
  const auto load = [&] {
    return ttsdf::Registration(
        std::make_shared<ttsdf::TtDistanceField>(ttsdf::benchmarkTrain(kRank), ttsdf::benchmarkGeometry()));
  };
  auto registration = load();
  for (int n = 0; n < 3; ++n) registration.align(points, prior);
  for (auto _ : state) {
    state.PauseTiming();
    if (start != Start::kWarm) registration = load();
    if (start == Start::kFirstCold) forgetCaches();
    state.ResumeTiming();
    benchmark::DoNotOptimize(registration.align(points, prior));
  }
}
BENCHMARK_CAPTURE(scan, warm, Start::kWarm)->Unit(benchmark::kMillisecond)->Iterations(1)->Repetitions(21);
BENCHMARK_CAPTURE(scan, first, Start::kFirst)->Unit(benchmark::kMillisecond)->Iterations(1)->Repetitions(21);
BENCHMARK_CAPTURE(scan, first_cold, Start::kFirstCold)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1)
    ->Repetitions(21);

}  // namespace

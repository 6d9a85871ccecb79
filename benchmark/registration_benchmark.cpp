// Registration of a scan of about 4 300 points: one start, many starts around a prior, the whole map.
#include <benchmark/benchmark.h>

#include "benchmark_world.h"
#include "ttsdf_localization/registration/search.h"

namespace {

using ttsdf::Interpolation;

Eigen::Isometry3d priorAt(double distance) {
  Eigen::Isometry3d T = ttsdf::benchmarkScan().T_map_sensor;
  T.translate(distance * Eigen::Vector3d(1.0, -2.0, 2.0).normalized());
  return T;
}

// Says how good the last answer was: a fast wrong answer is no result.
void report(benchmark::State& state, const ttsdf::RegistrationResult& result) {
  const auto& scan = ttsdf::benchmarkScan();
  state.counters["error_m"] = ttsdf::poseError(scan.T_map_sensor, result.T_map_sensor).translation;
  state.counters["iterations"] = result.iterations;
  state.counters["points"] = static_cast<double>(scan.points.cols());
}

void align(benchmark::State& state, const std::shared_ptr<const ttsdf::DistanceField>& field,
           double distance) {
  ttsdf::Registration registration(field);
  const auto& scan = ttsdf::benchmarkScan();
  ttsdf::RegistrationResult result = registration.align(scan.points, priorAt(distance));
  for (auto _ : state) result = registration.align(scan.points, priorAt(distance));
  report(state, result);
}

void trackDense(benchmark::State& state) {
  align(state, ttsdf::benchmarkDenseField(), static_cast<double>(state.range(0)) / 1000.0);
}
BENCHMARK(trackDense)->ArgName("mm")->Arg(100)->Arg(500)->Unit(benchmark::kMillisecond);

void trackTrain(benchmark::State& state) {
  align(state, ttsdf::benchmarkTrainField(static_cast<int>(state.range(0)), Interpolation::kTrilinear),
        static_cast<double>(state.range(1)) / 1000.0);
}
BENCHMARK(trackTrain)
    ->ArgNames({"rank", "mm"})
    ->ArgsProduct({{10, 20, 40, 80}, {100, 500}})
    ->Unit(benchmark::kMillisecond);

void search(benchmark::State& state) {
  ttsdf::Registration registration(
      ttsdf::benchmarkTrainField(static_cast<int>(state.range(0)), Interpolation::kTrilinear));
  const auto& scan = ttsdf::benchmarkScan();
  ttsdf::RegistrationResult result = ttsdf::searchNear(registration, scan.points, priorAt(0.5), {});
  for (auto _ : state) result = ttsdf::searchNear(registration, scan.points, priorAt(0.5), {});
  report(state, result);
}
BENCHMARK(search)->ArgName("rank")->Arg(20)->Arg(40)->Unit(benchmark::kMillisecond);

void global(benchmark::State& state) {
  ttsdf::Registration registration(ttsdf::benchmarkTrainField(40, Interpolation::kTrilinear));
  const auto& scan = ttsdf::benchmarkScan();
  const Eigen::Vector3d map_down(0.0, 0.0, -1.0);
  const Eigen::Vector3d gravity = scan.T_map_sensor.linear().transpose() * map_down;
  ttsdf::RegistrationResult result;
  for (auto _ : state) result = ttsdf::localizeGlobally(registration, scan.points, gravity, map_down, {});
  report(state, result);
}
BENCHMARK(global)->Unit(benchmark::kMillisecond)->Iterations(1)->UseRealTime();

// What the node does once when it loads a map.
void prepare(benchmark::State& state) {
  const auto field = ttsdf::benchmarkTrainField(40, Interpolation::kTrilinear);
  for (auto _ : state) benchmark::DoNotOptimize(ttsdf::Registration(field));
}
BENCHMARK(prepare)->Unit(benchmark::kMillisecond);

}  // namespace

// Value and gradient of a batch of points: the uncompressed array and the tensor train, cold and warm.
#include <benchmark/benchmark.h>

#include "benchmark_world.h"
#include "ttsdf_localization/field/tt_distance_field.h"

namespace {

using ttsdf::Interpolation;

/// Buffers of one batch, in map coordinates.
class Batch {
 public:
  Batch() {
    const auto& scan = ttsdf::benchmarkScan();
    const Eigen::Isometry3f T_map_sensor = scan.T_map_sensor.cast<float>();
    points_ = (T_map_sensor * scan.points.colwise().homogeneous()).topRows<3>().transpose();
    samples_.resize(points_.rows(), 4);
    states_.resize(static_cast<std::size_t>(points_.rows()));
  }
  void evaluate(const ttsdf::DistanceField& field) {
    const ttsdf::PointSpan points{points_.col(0).data(), points_.col(1).data(), points_.col(2).data(),
                                  static_cast<int>(points_.rows())};
    field.evaluate(points, {samples_.col(0).data(), samples_.col(1).data(), samples_.col(2).data(),
                            samples_.col(3).data(), states_.data()});
    benchmark::DoNotOptimize(samples_.data());
  }
  void report(benchmark::State& state) const {
    state.SetItemsProcessed(state.iterations() * points_.rows());
    state.counters["points"] = static_cast<double>(points_.rows());
    state.counters["s_per_point"] =
        benchmark::Counter(static_cast<double>(state.iterations()) * static_cast<double>(points_.rows()),
                           benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  }

 private:
  Eigen::MatrixX3f points_;
  Eigen::MatrixX4f samples_;
  std::vector<ttsdf::PointState> states_;
};

void denseField(benchmark::State& state) {
  const auto field = ttsdf::benchmarkDenseField();
  Batch batch;
  for (auto _ : state) batch.evaluate(*field);
  batch.report(state);
}
BENCHMARK(denseField);

void trainField(benchmark::State& state, Interpolation interpolation) {
  const auto field = ttsdf::benchmarkTrainField(static_cast<int>(state.range(0)), interpolation);
  Batch batch;
  batch.evaluate(*field);  // fills the cache of contracted columns
  for (auto _ : state) batch.evaluate(*field);
  batch.report(state);
  state.counters["cache_bytes"] =
      static_cast<double>(static_cast<const ttsdf::TtDistanceField&>(*field).memoryBytes());
}
BENCHMARK_CAPTURE(trainField, trilinear, Interpolation::kTrilinear)
    ->Arg(10)
    ->Arg(20)
    ->Arg(40)
    ->Arg(60)
    ->Arg(80);
BENCHMARK_CAPTURE(trainField, nearest, Interpolation::kNearest)->Arg(10)->Arg(20)->Arg(40)->Arg(60)->Arg(80);

// The first scan after loading: every column has to be contracted.
void trainFieldCold(benchmark::State& state) {
  Batch batch;
  for (auto _ : state) {
    state.PauseTiming();
    const auto field =
        ttsdf::benchmarkTrainField(static_cast<int>(state.range(0)), Interpolation::kTrilinear);
    state.ResumeTiming();
    batch.evaluate(*field);
  }
  batch.report(state);
}
BENCHMARK(trainFieldCold)->Arg(20)->Arg(40)->Arg(80);

}  // namespace

// A building of 737 x 935 x 311 voxels of 2 cm (214 million; 850 MB as a dense array) from the sparse volume
// to the map file, with the time of every step, the peak memory of the process and the errors near the
// surface.
//
// scripts/build --no-ros --benchmarks building_benchmark; then: building_benchmark --max-rank 40
// --refine-iterations 4

#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <random>
#include <string>

#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/signed_field/ideal_volume.h"
#include "ttsdf_localization/simulation/scene_sampling.h"
#include "ttsdf_localization/simulation/worlds.h"
#include "ttsdf_localization/tools/command_line.h"

namespace {

struct Arguments {
  std::string output;
  double share = 1.0;
  ttsdf::FusionOptions fusion;
  ttsdf::BuildOptions build;
};

struct Usage {
  double wall = 0.0, cpu = 0.0, peak_megabytes = 0.0;
};

Usage usage() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return {std::chrono::duration<double>(now).count(), seconds(u.ru_utime) + seconds(u.ru_stime),
          static_cast<double>(u.ru_maxrss) * 1024e-6};
}

/// Prints a step when the next one begins.
class StepTable {
 public:
  StepTable() { std::printf("%-28s %10s %10s %14s\n", "step", "wall [s]", "CPU [s]", "peak RSS [MB]"); }
  void begin(const std::string& name) {
    if (name == name_) return;
    end();
    name_ = name;
    start_ = usage();
  }
  void end() {
    if (name_.empty()) return;
    const Usage now = usage();
    row(name_, start_, now);
    name_.clear();
  }
  static void row(const std::string& name, const Usage& from, const Usage& to) {
    std::printf("%-28s %10.1f %10.1f %14.0f\n", name.c_str(), to.wall - from.wall, to.cpu - from.cpu,
                to.peak_megabytes);
    std::fflush(stdout);
  }

 private:
  std::string name_;
  Usage start_;
};

/// What was observed of the building: everything but its outermost 0.2 m (0.1 m of floor and roof), up to a
/// share of its length.
Eigen::AlignedBox3d observedBox(const ttsdf::AnalyticScene& scene, double share) {
  Eigen::AlignedBox3d box = scene.bounds();
  box.max().y() = box.min().y() + share * box.sizes().y();
  box.min() += Eigen::Vector3d(0.2, 0.2, 0.1);
  box.max() -= Eigen::Vector3d(0.2, 0.2, 0.1);
  return box;
}

/// What cameras inside see: rooms, corridors and the window reveals up to 0.2 m before the outer faces.
ttsdf::TsdfVolume observeInside(const ttsdf::AnalyticScene& scene, double share,
                                const ttsdf::FusionOptions& options) {
  const double h = options.voxel_size;
  const Eigen::AlignedBox3d box = observedBox(scene, share);
  const Eigen::Array3i begin = (box.min() / h).array().round().cast<int>();
  const ttsdf::Dims size = (box.max() / h).array().round().cast<int>() - begin + 1;
  ttsdf::GridGeometry geometry;
  geometry.dims = size;
  geometry.voxel_size = h;
  geometry.T_map_grid.translation() = h * begin.cast<double>().matrix();
  const auto distances = [&](const Eigen::Array3i& first, const ttsdf::Dims& count, float* out) {
    ttsdf::sampleDistances(scene, geometry, first - begin, count, out);
  };
  return ttsdf::idealVolume(distances, begin, size, options);
}

/// Rms difference between the map and the scene's exact distance at samples that were observed, within 3 cm
/// of a surface [m].
double errorAgainstScene(const ttsdf::BuiltMap& built, const ttsdf::AnalyticScene& scene, double share) {
  constexpr double kNear = 0.03;
  constexpr int kSamples = 200000;
  std::mt19937 random(1);
  Eigen::AlignedBox3d observed = observedBox(scene, share);
  observed.min().array() += kNear;
  observed.max().array() -= kNear;
  const ttsdf::Dims& dims = built.map.geometry.dims;
  const auto index = [&](int axis) { return std::uniform_int_distribution<int>(0, dims[axis] - 1)(random); };
  double squares = 0.0;
  int count = 0;
  while (count < kSamples) {
    const int i = index(0), j = index(1), k = index(2);
    const Eigen::Vector3d p = built.map.geometry.samplePosition(Eigen::Vector3d(i, j, k));
    if (!built.map.mask.atVoxel(i, j, k) || !observed.contains(p)) continue;
    const double truth = scene.signedDistance(p);
    if (std::abs(truth) > kNear) continue;
    const double error = built.map.train(i, j, k) - truth;
    squares += error * error;
    ++count;
  }
  return std::sqrt(squares / count);
}

int run(int argc, char** argv) {
  Arguments a;
  ttsdf::CommandLine line("building_benchmark", "[options]",
                          "Compresses a simulated building of 212 million voxels.");
  line.value("output", "MAP.ttsdf", a.output, "Keeps the map.")
      .value("share", "S", a.share, "Observes this part of the building's length only (0.1 to 1).")
      .options("fusion", ttsdf::fusionOptionTable(), a.fusion)
      .options("build", ttsdf::buildOptionTable(), a.build);
  if (!line.parse(argc, argv, std::cout)) return 0;
  if (!(a.share >= 0.1 && a.share <= 1.0))
    throw ttsdf::UsageError("--share: got " + std::to_string(a.share) + ", wanted 0.1 to 1");
  const ttsdf::AnalyticScene scene = ttsdf::makeBuilding();
  StepTable table;
  table.begin("(simulated observation)");
  const ttsdf::TsdfVolume volume = observeInside(scene, a.share, a.fusion);
  table.end();
  std::printf("sparse volume: %.0f MB\n", 1e-6 * static_cast<double>(volume.memoryBytes()));
  const Usage start = usage();
  const ttsdf::BuiltMap built = ttsdf::buildMap(volume, a.build, [&table](const std::string& step, double) {
    table.begin(step);
    return true;
  });
  table.end();
  const Usage end = usage();
  StepTable::row("sparse volume to map file", start, end);
  if (!a.output.empty()) ttsdf::writeFileAtomically(a.output, built.bytes);
  const ttsdf::Dims& dims = built.map.geometry.dims;
  std::printf("%d x %d x %d = %.1f million voxels, dense %.1f MB, %.0f %% observed\n", dims[0], dims[1],
              dims[2], 1e-6 * static_cast<double>(built.map.geometry.voxelCount()),
              1e-6 * static_cast<double>(built.report.dense_bytes), 100.0 * built.report.observed_share);
  std::printf("ranks %d and %d, %s: file %zu bytes, in memory %zu bytes\n", built.report.rank1,
              built.report.rank2, built.report.encoding.c_str(), built.report.file_bytes,
              built.report.memory_bytes);
  std::printf("rms error near the surface: %.2f mm against the uncompressed field, %.2f mm to the scene\n",
              1e3 * built.report.surface_rms, 1e3 * errorAgainstScene(built, scene, a.share));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("building_benchmark", [&] { return run(argc, argv); });
}

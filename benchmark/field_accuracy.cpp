// The uncompressed field against the exact distances of a simulated room: error near the surface and share of
// right signs, once for perfect observation of every voxel, once for noise-free depth frames fused with
// carving.
//
// scripts/build --no-ros --benchmarks field_accuracy; then: field_accuracy --scene apartment --frames 200

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include "ttsdf_localization/mapping/ideal_volume.h"
#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/simulation/scene_sampling.h"
#include "ttsdf_localization/simulation/simulated_rig.h"
#include "ttsdf_localization/tools/command_line.h"

namespace {

struct Arguments {
  int frames = 200;
  ttsdf::SimulatedRigOptions rig;
  ttsdf::FusionOptions fusion;
  ttsdf::BuildOptions build;
};

/// Of the samples that rays saw.
struct Accuracy {
  std::size_t seen = 0, right_signs = 0, far_wrong = 0;
  std::vector<double> near_errors;  ///< of the samples within 1.5 voxels of the surface [voxel]
};

constexpr double kOnSurface = 0.05;  ///< nearer to the surface a sign says nothing [voxel]

/// Whether the nearest surface is an outer face of the world, which nobody inside can see.
bool outerFaceIsNearest(const Eigen::AlignedBox3d& bounds, const Eigen::Vector3d& p, double truth) {
  const double to_face = std::min((p - bounds.min()).minCoeff(), (bounds.max() - p).minCoeff());
  return to_face <= std::abs(truth) + 1e-6;
}

Accuracy compare(const ttsdf::SampledField& field, const ttsdf::AnalyticScene& scene) {
  Accuracy result;
  const double h = field.geometry.voxel_size;
  const ttsdf::Dims& dims = field.geometry.dims;
  const Eigen::AlignedBox3d bounds = scene.bounds();
  std::size_t n = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++n) {
        if (!field.known[n]) continue;
        const Eigen::Vector3d p = field.geometry.samplePosition(Eigen::Vector3d(i, j, k));
        const double truth = scene.signedDistance(p), value = field.values.data()[n];
        if (outerFaceIsNearest(bounds, p, truth)) continue;
        const bool right = (truth < 0.0) == (value < 0.0) || std::abs(truth) < kOnSurface * h;
        ++result.seen;
        result.right_signs += right ? 1U : 0U;
        result.far_wrong += !right && std::abs(truth) > 0.5 * h ? 1U : 0U;
        if (std::abs(truth) <= 1.5 * h) result.near_errors.push_back(std::abs(value - truth) / h);
      }
    }
  }
  return result;
}

void print(const std::string& observation, Accuracy a) {
  const auto share = [&](std::size_t count) {
    return 100.0 * static_cast<double>(count) / static_cast<double>(a.seen);
  };
  double squares = 0.0;
  for (const double error : a.near_errors) squares += error * error;
  std::sort(a.near_errors.begin(), a.near_errors.end());
  const auto count = a.near_errors.size();
  const double rms = count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0.0;
  const double median = count > 0 ? a.near_errors[count / 2] : 0.0;
  std::printf("%-20s %12zu %12.4f %15.4f %16.4f %24.4f\n", observation.c_str(), a.seen, rms, median,
              share(a.right_signs), share(a.far_wrong));
}

/// Every voxel up to the truncation behind the surfaces, seen without error.
ttsdf::TsdfVolume observePerfectly(const ttsdf::AnalyticScene& scene, const ttsdf::FusionOptions& options) {
  const double h = options.voxel_size;
  ttsdf::GridGeometry geometry;
  const Eigen::Array3i begin = (scene.bounds().min() / h).array().floor().cast<int>();
  geometry.dims = (scene.bounds().max() / h).array().ceil().cast<int>() - begin + 1;
  geometry.voxel_size = h;
  geometry.T_map_grid.translation() = h * begin.cast<double>().matrix();
  const auto distances = [&](const Eigen::Array3i& first, const ttsdf::Dims& count, float* out) {
    ttsdf::sampleDistances(scene, geometry, first - begin, count, out);
  };
  return ttsdf::idealVolume(distances, begin, geometry.dims, options);
}

ttsdf::TsdfVolume observeThroughCamera(const Arguments& a) {
  ttsdf::SimulatedRig rig(a.rig);
  ttsdf::TsdfVolume volume(a.fusion);
  for (int n = 0; n < a.frames; ++n) {
    const auto state = rig.advance(rig.trajectory().duration() * n / a.frames);
    volume.integrate(rig.image(state), rig.camera().intrinsics(), state.T_map_base * rig.cameraMount());
  }
  return volume;
}

int run(int argc, char** argv) {
  Arguments a;
  a.build.align_axes = false;
  a.build.max_dense_voxels = 2000000000;  // arrays are what is read below
  ttsdf::CommandLine line("field_accuracy", "[options]", "The uncompressed field against a simulated room.");
  line.value("frames", "N", a.frames, "Depth frames, spread evenly over the camera's way through the world.")
      .options("world", ttsdf::simulatedRigOptionTable(), a.rig)
      .options("fusion", ttsdf::fusionOptionTable(), a.fusion);
  if (!line.parse(argc, argv, std::cout)) return 0;
  if (a.frames < 1) throw ttsdf::UsageError("--frames: got less than 1, wanted a number above 0");
  const ttsdf::AnalyticScene scene = ttsdf::makeWorld(a.rig.scene).scene;
  std::printf("%-20s %12s %12s %15s %16s %24s\n", "observation", "voxels seen", "rms [voxel]",
              "median [voxel]", "right signs [%]", "wrong beyond 0.5 vx [%]");
  print("every voxel", compare(ttsdf::sampleField(observePerfectly(scene, a.fusion), a.build), scene));
  print(std::to_string(a.frames) + " depth frames",
        compare(ttsdf::sampleField(observeThroughCamera(a), a.build), scene));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("field_accuracy", [&] { return run(argc, argv); });
}

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

#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/signed_field/ideal_volume.h"
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

/// A depth image and where it was taken.
struct View {
  ttsdf::DepthImage image;
  ttsdf::CameraIntrinsics intrinsics;
  Eigen::Isometry3d T_camera_map;

  /// Depth reading along the ray through a point [m], and the point's own depth; false where there is none.
  bool read(const Eigen::Vector3d& p_map, double& reading, double& depth) const {
    const Eigen::Vector3d p = T_camera_map * p_map;
    if (!(p.z() > 0.0)) return false;
    const auto u = static_cast<int>(std::lround(intrinsics.fx * p.x() / p.z() + intrinsics.cx));
    const auto v = static_cast<int>(std::lround(intrinsics.fy * p.y() / p.z() + intrinsics.cy));
    if (u < 0 || v < 0 || u >= image.width || v >= image.height) return false;
    reading = image.at(u, v), depth = p.z();
    return reading > 0.0;
  }
};

constexpr double kGrazing = 0.17;  ///< cosine below which fusion takes no surface from a ray (80 deg)

/// What rays saw. Without views: everything.
class Observers {
 public:
  Observers(std::vector<View> views, const ttsdf::FusionOptions& fusion)
      : views_(std::move(views)), fusion_(fusion) {}

  /// Whether a ray came through p (or to it).
  bool sawThrough(const Eigen::Vector3d& p) const {
    return any(
        [&](double reading, double depth, const View&) {
          return depth <= reading && depth >= fusion_.min_depth && depth <= fusion_.max_depth;
        },
        p);
  }

  /// Whether a ray ended on the surface at p.
  bool sawSurface(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const {
    return any(
        [&](double reading, double depth, const View& view) {
          const Eigen::Vector3d ray = p - view.T_camera_map.inverse().translation();
          return std::abs(reading - depth) <= 0.5 * fusion_.voxel_size && depth >= fusion_.min_depth &&
                 depth <= fusion_.max_depth && ray.dot(normal) < -kGrazing * ray.norm();
        },
        p);
  }

 private:
  template <class Test>
  bool any(const Test& test, const Eigen::Vector3d& p) const {
    if (views_.empty()) return true;
    return std::any_of(views_.begin(), views_.end(), [&](const View& view) {
      double reading = 0.0, depth = 0.0;
      return view.read(p, reading, depth) && test(reading, depth, view);
    });
  }

  std::vector<View> views_;
  ttsdf::FusionOptions fusion_;
};

/// Signs: of the samples that rays passed. Errors: of the samples within 1.5 voxels of a surface that rays
/// ended on [voxel].
struct Accuracy {
  std::size_t seen = 0, right_signs = 0, far_wrong = 0;
  std::vector<double> near_errors;
};

constexpr double kOnSurface = 0.05;  ///< nearer to the surface a sign says nothing [voxel]

/// Whether the nearest surface is an outer face of the world, which nobody inside can see.
bool outerFaceIsNearest(const Eigen::AlignedBox3d& bounds, const Eigen::Vector3d& p, double truth) {
  const double to_face = std::min((p - bounds.min()).minCoeff(), (bounds.max() - p).minCoeff());
  return to_face <= std::abs(truth) + 1e-6;
}

/// Inside matter the scene knows the distance only where no other solid covers the nearest surface.
bool knowsDistance(const ttsdf::AnalyticScene& scene, const Eigen::Vector3d& p, double truth, double voxel) {
  if (truth >= 0.0) return true;
  const double beyond = 0.1 * voxel;
  return scene.signedDistance(p + (beyond - truth) * scene.gradient(p)) > 0.5 * beyond;
}

void compareSample(const ttsdf::AnalyticScene& scene, const Observers& observers, const Eigen::Vector3d& p,
                   double value, double voxel, Accuracy& result) {
  const double truth = scene.signedDistance(p);
  if (outerFaceIsNearest(scene.bounds(), p, truth)) return;
  if (observers.sawThrough(p)) {
    const bool right = (truth < 0.0) == (value < 0.0) || std::abs(truth) < kOnSurface * voxel;
    ++result.seen;
    result.right_signs += right ? 1U : 0U;
    result.far_wrong += !right && std::abs(truth) > 0.5 * voxel ? 1U : 0U;
  }
  if (std::abs(truth) > 1.5 * voxel || !knowsDistance(scene, p, truth, voxel)) return;
  const Eigen::Vector3d normal = scene.gradient(p);
  if (observers.sawSurface(p - truth * normal, normal)) {
    result.near_errors.push_back(std::abs(value - truth) / voxel);
  }
}

Accuracy compare(const ttsdf::SampledField& field, const ttsdf::AnalyticScene& scene,
                 const Observers& observers) {
  Accuracy result;
  const ttsdf::Dims& dims = field.geometry.dims;
  std::size_t n = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++n) {
        if (!field.known[n]) continue;
        compareSample(scene, observers, field.geometry.samplePosition(Eigen::Vector3d(i, j, k)),
                      static_cast<double>(field.values.data()[n]), field.geometry.voxel_size, result);
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

std::vector<View> takeViews(const Arguments& a) {
  ttsdf::SimulatedRig rig(a.rig);
  std::vector<View> views;
  for (int n = 0; n < a.frames; ++n) {
    const auto state = rig.advance(rig.trajectory().duration() * n / a.frames);
    views.push_back(
        {rig.image(state), rig.camera().intrinsics(), (state.T_map_base * rig.cameraMount()).inverse()});
  }
  return views;
}

ttsdf::TsdfVolume fuse(const std::vector<View>& views, const ttsdf::FusionOptions& options) {
  ttsdf::TsdfVolume volume(options);
  for (const View& view : views) volume.integrate(view.image, view.intrinsics, view.T_camera_map.inverse());
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
  print("every voxel", compare(ttsdf::sampleField(observePerfectly(scene, a.fusion), a.build), scene,
                               Observers({}, a.fusion)));
  const std::vector<View> views = takeViews(a);
  print(std::to_string(a.frames) + " depth frames",
        compare(ttsdf::sampleField(fuse(views, a.fusion), a.build), scene, Observers(views, a.fusion)));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("field_accuracy", [&] { return run(argc, argv); });
}

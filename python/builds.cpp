#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "arguments.h"
#include "bindings.h"
#include "interrupts.h"
#include "map_object.h"
#include "ttsdf_localization/fusion/cloud_surface.h"
#include "ttsdf_localization/geometry/local_origin.h"
#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/mesh/mesh_sampling.h"

namespace ttsdf::python {

namespace {

std::unique_ptr<MapObject> finish(BuiltMap built) {
  return std::make_unique<MapObject>(std::move(built.map), std::move(built.bytes));
}

struct Options {
  FusionOptions fusion;
  BuildOptions build;
};

Options optionsOf(py::dict keywords) {
  Options options;
  // `threads` is in both tables.
  if (keywords.contains("threads"))
    buildOptionTable().setFromText(options.build, "threads", optionText(keywords["threads"]));
  take(keywords, fusionOptionTable(), options.fusion);
  take(keywords, buildOptionTable(), options.build);
  refuseRest(keywords);
  return options;
}

void refuseCounts(const std::string& poses, const std::string& images) {
  throw std::invalid_argument("build_frames: got " + poses + " poses for " + images +
                              " depth images, wanted one for each");
}

/// Before hours of fusion, where both know their lengths.
void checkCounts(const py::iterable& depths, const py::iterable& poses) {
  if (!py::hasattr(depths, "__len__") || !py::hasattr(poses, "__len__")) return;
  const std::size_t images = py::len(depths), given = py::len(poses);
  if (images != given) refuseCounts(std::to_string(given), std::to_string(images));
}

std::unique_ptr<MapObject> buildFrames(const py::iterable& depths, const py::iterable& poses,
                                       const py::object& intrinsics, double depth_scale,
                                       const py::kwargs& keywords) {
  const Options options = optionsOf(keywords);
  validate(options.build);
  CameraIntrinsics camera = intrinsicsOf(intrinsics);
  if (!(depth_scale > 0.0) || !std::isfinite(depth_scale))
    throw std::invalid_argument("depth_scale: got " + std::to_string(depth_scale) + ", wanted above 0");
  checkCounts(depths, poses);
  TsdfVolume volume(options.fusion);
  auto pose = py::iter(poses);
  std::size_t count = 0;
  for (const auto& item : depths) {
    const std::string number = std::to_string(count);
    if (pose == py::iterator::sentinel()) refuseCounts(number, "at least " + std::to_string(count + 1));
    try {
      const DepthImage image = depthOf(item, depth_scale);
      const Eigen::Isometry3d T = poseOf(*pose, "pose");
      camera.width = image.width, camera.height = image.height;
      interruptible([&](Interrupts& interrupts) {
        volume.integrate(image, camera, T);
        return interrupts.goOn();
      });
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("frame " + number + ": " + error.what());
    }
    ++pose, ++count;
  }
  if (pose != py::iterator::sentinel())
    refuseCounts("at least " + std::to_string(count + 1), std::to_string(count));
  if (count == 0) throw std::invalid_argument("build_frames: got no depth image, wanted at least one");
  if (volume.empty()) {
    throw std::invalid_argument(
        "build_frames: got " + std::to_string(count) + " depth images without a surface between min_depth " +
        toString(options.fusion.min_depth) + " and max_depth " + toString(options.fusion.max_depth) +
        " m; floats are metres, integers are divided by depth_scale");
  }
  return interruptible([&](Interrupts& interrupts) {
    return finish(buildMap(volume, options.build, progressOf(interrupts)));
  });
}

std::unique_ptr<MapObject> buildMesh(const py::object& vertices, const py::object& triangles,
                                     const py::kwargs& keywords) {
  const Options options = optionsOf(keywords);
  const Rows<double> rows(vertices, "vertices");
  const auto v = rows.columns();
  SurfaceMesh mesh;
  mesh.triangles = trianglesOf(triangles);
  if (v.cols() == 0 || !v.allFinite())
    throw std::invalid_argument("vertices: got none, or some that are not finite, wanted finite ones");
  return interruptible([&](Interrupts& interrupts) {
    const auto progress = progressOf(interrupts);
    mesh.origin = localOrigin(v.rowwise().minCoeff(), v.rowwise().maxCoeff());
    mesh.vertices = (v.colwise() - mesh.origin).cast<float>();
    return finish(compress(sampleMesh(mesh, options.fusion.voxel_size, options.build, progress),
                           options.fusion, options.build, progress));
  });
}

std::unique_ptr<MapObject> buildCloud(const py::object& points, const py::object& normals,
                                      const py::object& viewpoint, bool seen_from_inside,
                                      const py::kwargs& keywords) {
  const Options options = optionsOf(keywords);
  validate(options.build);
  OrientedCloud cloud;
  cloud.points = Rows<double>(points, "points").columns();
  if (!normals.is_none()) {
    cloud.normals = Rows<float>(normals, "normals").columns();
    if (cloud.normals.cols() != cloud.points.cols()) {
      throw std::invalid_argument("normals: got " + std::to_string(cloud.normals.cols()) + ", wanted " +
                                  std::to_string(cloud.points.cols()) + ", one for each point");
    }
  }
  if (!viewpoint.is_none()) cloud.viewpoint = vectorOf(viewpoint, "viewpoint");
  cloud.seen_from_inside = seen_from_inside;
  return interruptible([&](Interrupts& interrupts) {
    const auto progress = progressOf(interrupts);
    return finish(
        buildMap(volumeFromCloud(cloud, options.fusion, nullptr, progress), options.build, progress));
  });
}

}  // namespace

void bindBuilds(py::module& m) {
  m.def("build_frames", &buildFrames, py::arg("depths"), py::arg("poses"), py::arg("intrinsics"),
        py::arg("depth_scale") = 1000.0,
        "A map of depth images (integers: divided by depth_scale; floats: metres) with their camera-to-world "
        "poses.");
  m.def("build_mesh", &buildMesh, py::arg("vertices"), py::arg("triangles"), "A map of a triangle mesh [m].");
  m.def("build_cloud", &buildCloud, py::arg("points"), py::arg("normals") = py::none(),
        py::arg("viewpoint") = py::none(), py::arg("seen_from_inside") = true,
        "A map of points of surfaces [m].");
}

}  // namespace ttsdf::python

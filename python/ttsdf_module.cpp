// The Python module `ttsdf`: numpy in and out, options by keyword, errors as ValueError with the library's
// own words.

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "arguments.h"
#include "interrupts.h"
#include "ttsdf_localization/exports/exports.h"
#include "ttsdf_localization/exports/occupancy.h"
#include "ttsdf_localization/fusion/cloud_surface.h"
#include "ttsdf_localization/geometry/local_origin.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/mesh/mesh_sampling.h"
#include "ttsdf_localization/readers/cloud_file.h"
#include "ttsdf_localization/registration/search.h"

namespace {

using namespace ttsdf;
using namespace ttsdf::python;

class PyMap {
 public:
  PyMap(TtSdfMap map, std::vector<std::uint8_t> bytes)
      : map_(std::move(map)), bytes_(std::move(bytes)), field_(makeField(map_)) {}

  static std::unique_ptr<PyMap> load(const py::object& file) {
    const std::string path = pathOf(file);
    const py::gil_scoped_release released;
    std::vector<std::uint8_t> bytes = readFile(path);
    try {
      TtSdfMap map = deserialize(bytes.data(), bytes.size());
      return std::make_unique<PyMap>(std::move(map), std::move(bytes));
    } catch (const MapFormatError& error) {
      throw MapFormatError("'" + path + "': " + error.what());
    }
  }
  void save(const py::object& file) const {
    const std::string path = pathOf(file);
    const py::gil_scoped_release released;
    writeFileAtomically(path, bytes_);
  }

  const TtSdfMap& map() const { return map_; }
  const std::shared_ptr<const DistanceField>& field() const { return field_; }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  TtSdfMap map_;
  std::vector<std::uint8_t> bytes_;
  std::shared_ptr<const DistanceField> field_;
};

py::tuple query(const PyMap& self, const py::object& points) {
  const Rows<double> rows(points, "points");
  const auto in = rows.columns();
  Eigen::VectorXf values(in.cols());
  Eigen::Matrix3Xf gradients(3, in.cols());
  Eigen::Array<bool, Eigen::Dynamic, 1> valid(in.cols());
  interruptible([&](Interrupts& interrupts) {
    constexpr Eigen::Index kAtATime = 100000;
    const Eigen::Vector3d& origin = self.field()->geometry().origin;
    for (Eigen::Index begin = 0; begin < in.cols() && interrupts.goOn(); begin += kAtATime) {
      const Eigen::Index size = std::min(kAtATime, in.cols() - begin);
      const FieldSamples samples =
          self.field()->evaluate((in.middleCols(begin, size).colwise() - origin).cast<float>().eval());
      values.segment(begin, size) = samples.values;
      gradients.middleCols(begin, size) = samples.gradients;
      for (Eigen::Index n = 0; n < size; ++n)
        valid[begin + n] = samples.states[static_cast<std::size_t>(n)] == PointState::kValid;
    }
    return true;
  });
  return py::make_tuple(values, asRows(std::move(gradients)), valid);
}

py::dict info(const PyMap& self) {
  const TtSdfMap& map = self.map();
  const MapFileInfo file = fileInfo(self.bytes().data(), self.bytes().size());
  py::dict result;
  result["dims"] = py::make_tuple(map.geometry.dims[0], map.geometry.dims[1], map.geometry.dims[2]);
  result["ranks"] = py::make_tuple(map.train.rank1(), map.train.rank2());
  result["voxel_size"] = map.geometry.voxel_size;
  result["T_map_grid"] = Eigen::Matrix4d(map.geometry.T_map_grid.matrix());
  result["field"] = name(map.kind);
  result["encoding"] = name(file.encoding);
  result["truncation"] = map.truncation;
  result["frame_id"] = map.frame_id;
  result["map_id"] = file.map_id;
  result["file_bytes"] = self.bytes().size();
  return result;
}

/// A scan against a map; keeps its work space between scans.
class PyRegistration {
 public:
  PyRegistration(const PyMap& map, py::kwargs options) {
    py::dict rest = options;
    RegistrationOptions registration;
    take(rest, registrationOptionTable(), registration);
    // Several tables have `starts` and the like: the names that are left go to the mode's table when it runs.
    rest_ = rest;
    for (const auto& item : rest) {
      const auto key = item.first.cast<std::string>();
      if (!searchOptionTable().has(key) && !globalOptionTable().has(key)) refuseRest(rest);
    }
    const py::gil_scoped_release released;
    registration_ = std::make_unique<Registration>(map.field(), registration);
  }

  RegistrationResult track(const py::object& points, const py::object& prior) {
    const Rows<float> scan(points, "points");
    const Eigen::Isometry3d T = poseOf(prior, "prior");
    const py::gil_scoped_release released;
    const std::lock_guard<std::mutex> alone(mutex_);
    return registration_->align(scan.columns(), T);
  }
  RegistrationResult search(const py::object& points, const py::object& prior) {
    const Rows<float> scan(points, "points");
    const Eigen::Isometry3d T = poseOf(prior, "prior");
    SearchOptions options;
    py::dict rest = rest_;
    take(rest, searchOptionTable(), options);
    const py::gil_scoped_release released;
    const std::lock_guard<std::mutex> alone(mutex_);
    return searchNear(*registration_, scan.columns(), T, options);
  }
  RegistrationResult global(const py::object& points, const py::object& gravity, const py::object& map_down) {
    const Rows<float> scan(points, "points");
    std::optional<Eigen::Vector3d> down;
    if (!gravity.is_none()) down = directionOf(gravity, "gravity");
    const Eigen::Vector3d down_of_map = directionOf(map_down, "map_down");
    GlobalOptions options;
    py::dict rest = rest_;
    take(rest, globalOptionTable(), options);
    return interruptible([&](Interrupts& interrupts) {
      const std::lock_guard<std::mutex> alone(mutex_);
      return localizeGlobally(*registration_, scan.columns(), down, down_of_map, options,
                              progressOf(interrupts));
    });
  }

 private:
  std::mutex mutex_;  // the work space is one scan's at a time
  std::unique_ptr<Registration> registration_;
  py::dict rest_;
};

std::unique_ptr<PyMap> finish(BuiltMap built) {
  return std::make_unique<PyMap>(std::move(built.map), std::move(built.bytes));
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

std::unique_ptr<PyMap> buildFrames(const py::iterable& depths, const py::iterable& poses,
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

std::unique_ptr<PyMap> buildMesh(const py::object& vertices, const py::object& triangles,
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

std::unique_ptr<PyMap> buildCloud(const py::object& points, const py::object& normals,
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

py::tuple surface(const PyMap& self) {
  SurfaceMesh mesh;
  Eigen::Matrix3Xd vertices;
  {
    const py::gil_scoped_release released;
    mesh = extractSurface(self.map());
    vertices = mesh.vertices.cast<double>().colwise() + mesh.origin;
  }
  return py::make_tuple(asRows(std::move(vertices)), asRows(std::move(mesh.triangles)));
}

py::dict occupancy(const PyMap& self, double resolution, double min_height, double max_height) {
  OccupancyImage image;
  {
    const py::gil_scoped_release released;
    image = occupancyOf(self.map(), {resolution, min_height, max_height});
  }
  py::array_t<std::int8_t> cells({image.height, image.width});
  std::copy(image.cells.begin(), image.cells.end(), cells.mutable_data());
  py::dict result;
  result["cells"] = cells;
  result["resolution"] = image.resolution;
  result["origin"] = image.origin;
  return result;
}

}  // namespace

PYBIND11_MODULE(ttsdf, m) {
  m.doc() =
      "Signed distance maps compressed with the tensor-train decomposition: build, query, localize in them.";
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const py::builtin_exception&) {
      throw;
    } catch (const py::error_already_set&) {
      throw;
    } catch (const std::runtime_error& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    } catch (const std::invalid_argument& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    }
  });

  py::class_<RegistrationResult>(m, "Result", "What a registration found.")
      .def_property_readonly(
          "pose", [](const RegistrationResult& r) { return Eigen::Matrix4d(r.T_map_sensor.matrix()); },
          "T_map_sensor, 4 x 4")
      .def_readonly("success", &RegistrationResult::success)
      .def_property_readonly("reason", [](const RegistrationResult& r) { return name(r.reason); })
      .def_readonly("iterations", &RegistrationResult::iterations)
      .def_readonly("points", &RegistrationResult::points)
      .def_readonly("rms_residual", &RegistrationResult::rms_residual)
      .def_readonly("inlier_ratio", &RegistrationResult::inlier_ratio)
      .def_readonly("score", &RegistrationResult::score)
      .def_readonly("confidence", &RegistrationResult::confidence)
      .def_readonly("runner_up_score", &RegistrationResult::runner_up_score)
      .def_readonly("degenerate_directions", &RegistrationResult::degenerate_directions)
      .def_readonly("milliseconds", &RegistrationResult::milliseconds)
      .def_property_readonly(
          "covariance", [](const RegistrationResult& r) { return r.covariance; },
          "6 x 6, [rotation; translation] about the sensor's position")
      .def("__repr__", [](const RegistrationResult& r) {
        return std::string("<ttsdf.Result ") + (r.success ? "success" : "no success") + ", " +
               name(r.reason) + ">";
      });

  py::class_<PyMap>(m, "Map", "A compressed map.")
      .def("save", &PyMap::save, py::arg("path"))
      .def("query", &query, py::arg("points"),
           "Points (n, 3) of the map frame -> distances (n), gradients (n, 3), valid (n).")
      .def_property_readonly("info", &info)
      .def("surface", &surface, "Vertices (n, 3) and triangles (m, 3) of the zero level.")
      .def("occupancy", &occupancy, py::arg("resolution") = 0.0, py::arg("min_height") = -1e9,
           py::arg("max_height") = 1e9,
           "Cells of nav_msgs/OccupancyGrid: -1 unknown, 0 free, 100 occupied; rows rise with y.")
      .def(
          "registration",
          [](const PyMap& map, py::kwargs options) { return std::make_unique<PyRegistration>(map, options); },
          "A registration of scans in this map; options of the tables registration, search and global by "
          "keyword.")
      .def("__repr__", [](const PyMap& self) {
        const auto& d = self.map().geometry.dims;
        return "<ttsdf.Map " + std::to_string(d[0]) + " x " + std::to_string(d[1]) + " x " +
               std::to_string(d[2]) + ", " + std::to_string(self.bytes().size()) + " bytes>";
      });

  py::class_<PyRegistration>(m, "Registration",
                             "Localizes scans, points (n, 3) of the sensor's frame [m], in a map.")
      .def("track", &PyRegistration::track, py::arg("points"), py::arg("prior"))
      .def("search", &PyRegistration::search, py::arg("points"), py::arg("prior"))
      .def("globally", &PyRegistration::global, py::arg("points"), py::arg("gravity") = py::none(),
           py::arg("map_down") = Eigen::Vector3d(0.0, 0.0, -1.0));

  m.def("load", &PyMap::load, py::arg("path"), "Reads a map file.");
  m.def(
      "read_points",
      [](const py::object& file) {
        const std::string path = pathOf(file);
        CloudFile cloud;
        {
          const py::gil_scoped_release released;
          cloud = readCloudFile(path);
        }
        return asRows(std::move(cloud.points));
      },
      py::arg("path"), "Points (n, 3) of a .pcd, .ply, .xyz, .csv or .bin file.");
  m.def(
      "read_mesh",
      [](const py::object& file, double scale) {
        const std::string path = pathOf(file);
        SurfaceMesh mesh;
        Eigen::Matrix3Xd vertices;
        {
          const py::gil_scoped_release released;
          mesh = readMesh(path, scale);
          vertices = mesh.vertices.cast<double>().colwise() + mesh.origin;
        }
        return py::make_tuple(asRows(std::move(vertices)), asRows(std::move(mesh.triangles)));
      },
      py::arg("path"), py::arg("scale") = 1.0, "Vertices (n, 3) and triangles (m, 3).");
  m.def("build_frames", &buildFrames, py::arg("depths"), py::arg("poses"), py::arg("intrinsics"),
        py::arg("depth_scale") = 1000.0,
        "A map of depth images (integers: divided by depth_scale; floats: metres) with their camera-to-world "
        "poses.");
  m.def("build_mesh", &buildMesh, py::arg("vertices"), py::arg("triangles"), "A map of a triangle mesh [m].");
  m.def("build_cloud", &buildCloud, py::arg("points"), py::arg("normals") = py::none(),
        py::arg("viewpoint") = py::none(), py::arg("seen_from_inside") = true,
        "A map of points of surfaces [m].");
}

// The Python module `ttsdf`: numpy in and out, options by keyword, errors as ValueError with the library's
// own words.

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <string>

#include "ttsdf_localization/exports/exports.h"
#include "ttsdf_localization/exports/occupancy.h"
#include "ttsdf_localization/fusion/cloud_surface.h"
#include "ttsdf_localization/geometry/local_origin.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/mesh/mesh_sampling.h"
#include "ttsdf_localization/readers/cloud_file.h"
#include "ttsdf_localization/registration/search.h"

namespace py = pybind11;

namespace {

using namespace ttsdf;

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

std::string textOf(const py::handle& value) {
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>() ? "true" : "false";
  return py::str(value).cast<std::string>();
}

/// Moves the keywords that a table knows into its options.
template <class Options>
void take(py::dict& keywords, const OptionTable<Options>& table, Options& options) {
  py::dict rest;
  for (const auto& item : keywords) {
    const auto name = item.first.cast<std::string>();
    if (table.has(name)) {
      table.setFromText(options, name, textOf(item.second));
    } else {
      rest[item.first] = item.second;
    }
  }
  keywords = rest;
}

void refuseRest(const py::dict& keywords) {
  for (const auto& item : keywords) {
    throw std::invalid_argument("option '" + item.first.cast<std::string>() + "': unknown");
  }
}

std::string shapeOf(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t n = 0; n < array.ndim(); ++n) text += (n ? ", " : "") + std::to_string(array.shape(n));
  return text + ")";
}

/// An n x 3 array seen as 3 x n: rows of numpy are columns of Eigen, so nothing is copied.
template <class T>
Eigen::Map<const Eigen::Matrix<T, 3, Eigen::Dynamic>> columns(const Array<T>& array, const char* what) {
  if (array.ndim() != 2 || array.shape(1) != 3) {
    throw std::invalid_argument(std::string(what) + ": got an array of shape " + shapeOf(array) +
                                ", wanted (n, 3)");
  }
  return {array.data(), 3, array.shape(0)};
}

Eigen::Isometry3d poseOf(const Array<double>& array, const char* what) {
  if (array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4) {
    throw std::invalid_argument(std::string(what) + ": got an array of shape " + shapeOf(array) +
                                ", wanted (4, 4)");
  }
  return orthonormalized(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(array.data()));
}

/// Hands a matrix to numpy as n x 3, without a copy: the capsule owns it.
template <class Matrix>
py::array asRows(Matrix&& matrix) {
  using Owned = std::decay_t<Matrix>;
  using T = typename Owned::Scalar;
  auto* owned = new Owned(std::forward<Matrix>(matrix));
  const py::capsule owner(owned, [](void* p) { delete static_cast<Owned*>(p); });
  return py::array_t<T>({owned->cols(), owned->rows()}, owned->data(), owner);
}

class PyMap {
 public:
  PyMap(TtSdfMap map, std::vector<std::uint8_t> bytes)
      : map_(std::move(map)), bytes_(std::move(bytes)), field_(makeField(map_)) {}

  static std::unique_ptr<PyMap> load(const std::string& path) {
    std::vector<std::uint8_t> bytes = readFile(path);
    TtSdfMap map = deserialize(bytes.data(), bytes.size());
    return std::make_unique<PyMap>(std::move(map), std::move(bytes));
  }
  void save(const std::string& path) const { writeFileAtomically(path, bytes_); }

  const TtSdfMap& map() const { return map_; }
  const std::shared_ptr<const DistanceField>& field() const { return field_; }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  TtSdfMap map_;
  std::vector<std::uint8_t> bytes_;
  std::shared_ptr<const DistanceField> field_;
};

py::tuple query(const PyMap& self, const Array<double>& points) {
  const auto in = columns(points, "points");
  FieldSamples samples;
  Eigen::Array<bool, Eigen::Dynamic, 1> valid(in.cols());
  {
    const py::gil_scoped_release released;
    samples = self.field()->evaluate((in.colwise() - self.field()->geometry().origin).cast<float>().eval());
    for (Eigen::Index n = 0; n < valid.size(); ++n)
      valid[n] = samples.states[static_cast<std::size_t>(n)] == PointState::kValid;
  }
  return py::make_tuple(samples.values, asRows(std::move(samples.gradients)), valid);
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

  RegistrationResult track(const Array<float>& points, const Array<double>& prior) {
    const ScanPoints scan = columns(points, "points");
    const Eigen::Isometry3d T = poseOf(prior, "prior");
    const py::gil_scoped_release released;
    return registration_->align(scan, T);
  }
  RegistrationResult search(const Array<float>& points, const Array<double>& prior) {
    const ScanPoints scan = columns(points, "points");
    const Eigen::Isometry3d T = poseOf(prior, "prior");
    SearchOptions options;
    py::dict rest = rest_;
    take(rest, searchOptionTable(), options);
    const py::gil_scoped_release released;
    return searchNear(*registration_, scan, T, options);
  }
  RegistrationResult global(const Array<float>& points, const std::optional<Eigen::Vector3d>& gravity,
                            const Eigen::Vector3d& map_down) {
    const ScanPoints scan = columns(points, "points");
    GlobalOptions options;
    py::dict rest = rest_;
    take(rest, globalOptionTable(), options);
    const py::gil_scoped_release released;
    return localizeGlobally(*registration_, scan, gravity, map_down, options);
  }

 private:
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
    buildOptionTable().setFromText(options.build, "threads", textOf(keywords["threads"]));
  take(keywords, fusionOptionTable(), options.fusion);
  take(keywords, buildOptionTable(), options.build);
  refuseRest(keywords);
  return options;
}

/// A depth image as metres; integers are divided by depth_scale.
DepthImage depthOf(const py::handle& item, double depth_scale) {
  const auto array = py::cast<py::array>(item);
  if (array.ndim() != 2)
    throw std::invalid_argument("depth image: got an array of shape " + shapeOf(array) +
                                ", wanted (height, width)");
  const bool metres = array.dtype().kind() == 'f';
  const Array<float> values = py::cast<Array<float>>(array);
  DepthImage image;
  image.width = static_cast<int>(values.shape(1));
  image.height = static_cast<int>(values.shape(0));
  image.depth.assign(values.data(), values.data() + values.size());
  if (!metres) {
    for (float& z : image.depth) z = z == 65535.0F ? 0.0F : z / static_cast<float>(depth_scale);
  }
  return image;
}

std::unique_ptr<PyMap> buildFrames(const py::iterable& depths, const py::iterable& poses,
                                   const Array<double>& intrinsics, double depth_scale,
                                   const py::kwargs& keywords) {
  const Options options = optionsOf(keywords);
  CameraIntrinsics camera;
  if (intrinsics.ndim() == 2 && intrinsics.shape(0) >= 3 && intrinsics.shape(1) >= 3) {
    camera.fx = intrinsics.at(0, 0), camera.fy = intrinsics.at(1, 1);
    camera.cx = intrinsics.at(0, 2), camera.cy = intrinsics.at(1, 2);
  } else if (intrinsics.ndim() == 1 && intrinsics.shape(0) == 4) {
    camera.fx = intrinsics.at(0), camera.fy = intrinsics.at(1), camera.cx = intrinsics.at(2),
    camera.cy = intrinsics.at(3);
  } else {
    throw std::invalid_argument("intrinsics: got an array of shape " + shapeOf(intrinsics) +
                                ", wanted (3, 3) or fx, fy, cx, cy");
  }
  if (!(depth_scale > 0.0))
    throw std::invalid_argument("depth_scale: got " + std::to_string(depth_scale) + ", wanted above 0");
  TsdfVolume volume(options.fusion);
  auto pose = py::iter(poses);
  for (const auto& item : depths) {
    if (pose == py::iterator::sentinel()) throw std::invalid_argument("poses: got fewer than depth images");
    const DepthImage image = depthOf(item, depth_scale);
    const Eigen::Isometry3d T = poseOf(py::cast<Array<double>>(*pose), "pose");
    ++pose;
    camera.width = image.width, camera.height = image.height;
    const py::gil_scoped_release released;
    volume.integrate(image, camera, T);
  }
  const py::gil_scoped_release released;
  return finish(buildMap(volume, options.build));
}

std::unique_ptr<PyMap> buildMesh(const Array<double>& vertices, const Array<int>& triangles,
                                 const py::kwargs& keywords) {
  const Options options = optionsOf(keywords);
  const auto v = columns(vertices, "vertices");
  SurfaceMesh mesh;
  mesh.triangles = columns(triangles, "triangles");
  if (v.cols() == 0 || !v.allFinite())
    throw std::invalid_argument("vertices: got none, or some that are not finite");
  const py::gil_scoped_release released;
  mesh.origin = localOrigin(v.rowwise().minCoeff(), v.rowwise().maxCoeff());
  mesh.vertices = (v.colwise() - mesh.origin).cast<float>();
  return finish(
      compress(sampleMesh(mesh, options.fusion.voxel_size, options.build), options.fusion, options.build));
}

std::unique_ptr<PyMap> buildCloud(const Array<double>& points, const std::optional<Array<float>>& normals,
                                  const std::optional<Eigen::Vector3d>& viewpoint, bool seen_from_inside,
                                  const py::kwargs& keywords) {
  const Options options = optionsOf(keywords);
  OrientedCloud cloud;
  cloud.points = columns(points, "points");
  if (normals) cloud.normals = columns(*normals, "normals");
  cloud.viewpoint = viewpoint;
  cloud.seen_from_inside = seen_from_inside;
  const py::gil_scoped_release released;
  return finish(buildMap(volumeFromCloud(cloud, options.fusion), options.build));
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
      .def("globally", &PyRegistration::global, py::arg("points"), py::arg("gravity") = std::nullopt,
           py::arg("map_down") = Eigen::Vector3d(0.0, 0.0, -1.0));

  m.def("load", &PyMap::load, py::arg("path"), "Reads a map file.");
  m.def(
      "read_points", [](const std::string& path) { return asRows(readCloudFile(path).points); },
      py::arg("path"), "Points (n, 3) of a .pcd, .ply, .xyz, .csv or .bin file.");
  m.def(
      "read_mesh",
      [](const std::string& path, double scale) {
        SurfaceMesh mesh = readMesh(path, scale);
        Eigen::Matrix3Xd vertices = mesh.vertices.cast<double>().colwise() + mesh.origin;
        return py::make_tuple(asRows(std::move(vertices)), asRows(std::move(mesh.triangles)));
      },
      py::arg("path"), py::arg("scale") = 1.0, "Vertices (n, 3) and triangles (m, 3).");
  m.def("build_frames", &buildFrames, py::arg("depths"), py::arg("poses"), py::arg("intrinsics"),
        py::arg("depth_scale") = 1000.0,
        "A map of depth images (integers: divided by depth_scale; floats: metres) with their camera-to-world "
        "poses.");
  m.def("build_mesh", &buildMesh, py::arg("vertices"), py::arg("triangles"), "A map of a triangle mesh [m].");
  m.def("build_cloud", &buildCloud, py::arg("points"), py::arg("normals") = std::nullopt,
        py::arg("viewpoint") = std::nullopt, py::arg("seen_from_inside") = true,
        "A map of points of surfaces [m].");
}

#include "map_object.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bindings.h"
#include "interrupts.h"
#include "ttsdf_localization/exports/occupancy.h"
#include "ttsdf_localization/files/file_writer.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf::python {

MapObject::MapObject(TtSdfMap map, std::vector<std::uint8_t> bytes)
    : map_(std::move(map)), bytes_(std::move(bytes)), field_(makeField(map_)) {}

std::unique_ptr<MapObject> MapObject::load(const py::object& file) {
  const std::string path = pathOf(file);
  const py::gil_scoped_release released;
  std::vector<std::uint8_t> bytes = readFile(path);
  try {
    TtSdfMap map = deserialize(bytes.data(), bytes.size());
    return std::make_unique<MapObject>(std::move(map), std::move(bytes));
  } catch (const MapFormatError& error) {
    throw MapFormatError("'" + path + "': " + error.what());
  }
}

void MapObject::save(const py::object& file) const {
  const std::string path = pathOf(file);
  const py::gil_scoped_release released;
  writeFileAtomically(path, bytes_);
}

namespace {

py::tuple query(const MapObject& self, const py::object& points) {
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

py::dict info(const MapObject& self) {
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

py::tuple surface(const MapObject& self) {
  SurfaceMesh mesh;
  Eigen::Matrix3Xd vertices;
  {
    const py::gil_scoped_release released;
    mesh = extractSurface(self.map());
    vertices = mesh.vertices.cast<double>().colwise() + mesh.origin;
  }
  return py::make_tuple(asRows(std::move(vertices)), asRows(std::move(mesh.triangles)));
}

py::dict occupancy(const MapObject& self, double resolution, double min_height, double max_height) {
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

py::class_<MapObject> bindMap(py::module& m) {
  py::class_<MapObject> map(m, "Map", "A compressed map.");
  map.def("save", &MapObject::save, py::arg("path"))
      .def("query", &query, py::arg("points"),
           "Points (n, 3) of the map frame -> distances (n), gradients (n, 3), valid (n).")
      .def_property_readonly("info", &info)
      .def("surface", &surface, "Vertices (n, 3) and triangles (m, 3) of the zero level.")
      .def("occupancy", &occupancy, py::arg("resolution") = 0.0, py::arg("min_height") = -1e9,
           py::arg("max_height") = 1e9,
           "Cells of nav_msgs/OccupancyGrid: -1 unknown, 0 free, 100 occupied; rows rise with y.")
      .def("__repr__", [](const MapObject& self) {
        const auto& d = self.map().geometry.dims;
        return "<ttsdf.Map " + std::to_string(d[0]) + " x " + std::to_string(d[1]) + " x " +
               std::to_string(d[2]) + ", " + std::to_string(self.bytes().size()) + " bytes>";
      });

  m.def("load", &MapObject::load, py::arg("path"), "Reads a map file.");
  return map;
}

}  // namespace ttsdf::python

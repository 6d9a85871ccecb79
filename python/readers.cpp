#include <string>
#include <utility>

#include "arguments.h"
#include "bindings.h"
#include "ttsdf_localization/readers/cloud_file.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf::python {

void bindReaders(py::module& m) {
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
}

}  // namespace ttsdf::python

#pragma once
// The parts of the module.

#include "map_object.h"

namespace ttsdf::python {

/// Map and load. First: the signatures of the others name its class.
py::class_<MapObject> bindMap(py::module& m);
/// Registration, Result and Map.registration.
void bindRegistration(py::module& m, py::class_<MapObject>& map);
/// build_frames, build_mesh and build_cloud.
void bindBuilds(py::module& m);
/// read_points and read_mesh.
void bindReaders(py::module& m);

}  // namespace ttsdf::python

#include <pybind11/eigen.h>

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "arguments.h"
#include "bindings.h"
#include "interrupts.h"
#include "map_object.h"
#include "ttsdf_localization/field/long_range_field.h"
#include "ttsdf_localization/registration/search.h"

namespace ttsdf::python {

namespace {

/// A scan against a map; keeps its work space between scans.
class RegistrationObject {
 public:
  RegistrationObject(const MapObject& map, py::kwargs options) {
    py::dict rest = options;
    RegistrationOptions registration;
    take(rest, registrationOptionTable(), registration);
    // Several tables have `starts` and the like: the names that are left go to the mode's table when it runs.
    rest_ = rest;
    for (const auto& item : rest) {
      const auto key = item.first.cast<std::string>();
      if (!searchOptionTable().has(key) && !globalOptionTable().has(key)) refuseRest(rest);
    }
    const std::shared_ptr<const DistanceField>& field = map.field();
    registration_ = interruptible([&](Interrupts& interrupts) {
      // What takes long in a large map, made ahead where Ctrl-C is looked at.
      std::shared_ptr<const DistanceField> far;
      if (registration.long_range && registration.method == "robust") {
        far = makeLongRangeField(*field, {}, progressOf(interrupts));
        field->warmUp(progressOf(interrupts));
      }
      return std::make_unique<Registration>(field, registration, far);
    });
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

}  // namespace

void bindRegistration(py::module& m, py::class_<MapObject>& map) {
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

  py::class_<RegistrationObject>(m, "Registration",
                                 "Localizes scans, points (n, 3) of the sensor's frame [m], in a map.")
      .def("track", &RegistrationObject::track, py::arg("points"), py::arg("prior"))
      .def("search", &RegistrationObject::search, py::arg("points"), py::arg("prior"))
      .def("globally", &RegistrationObject::global, py::arg("points"), py::arg("gravity") = py::none(),
           py::arg("map_down") = Eigen::Vector3d(0.0, 0.0, -1.0));

  map.def(
      "registration",
      [](const MapObject& self, py::kwargs options) {
        return std::make_unique<RegistrationObject>(self, options);
      },
      "A registration of scans in this map; options of the tables registration, search and global by "
      "keyword.");
}

}  // namespace ttsdf::python

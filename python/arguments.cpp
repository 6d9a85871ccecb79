#include "arguments.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf::python {

namespace {

[[noreturn]] void refuse(const char* what, const std::string& got, const std::string& wanted) {
  throw std::invalid_argument(std::string(what) + ": got " + got + ", wanted " + wanted);
}

std::string typeOf(const py::array& array) { return py::str(array.dtype()).cast<std::string>(); }

Array<double> shaped(const py::handle& value, const char* what, py::ssize_t rows, py::ssize_t columns) {
  const py::array array = numbers(value, what);
  const bool good = columns == 0 ? array.ndim() == 1 && array.shape(0) == rows
                                 : array.ndim() == 2 && array.shape(0) == rows && array.shape(1) == columns;
  if (!good) {
    refuse(what, "an array of shape " + shapeOf(array),
           columns == 0 ? "(" + std::to_string(rows) + ")"
                        : "(" + std::to_string(rows) + ", " + std::to_string(columns) + ")");
  }
  return py::cast<Array<double>>(array);
}

}  // namespace

py::array numbers(const py::handle& value, const char* what) {
  if (py::isinstance(value, py::module::import("numpy.ma").attr("MaskedArray")))
    refuse(what, "a masked array", "one without a mask (.filled(0) for depth, .compressed() for rows)");
  // As numpy.asarray, whose errors are better than those of a cast. Those that say what the value is not are
  // told with the argument's name; any other (Ctrl-C, sys.exit, what a lazy array meets) stays what it is.
  py::array array;
  try {
    array = py::module::import("numpy").attr("asarray")(value);
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError)) throw;
    refuse(what, py::repr(value.get_type()).cast<std::string>(),
           "an array of numbers (" + py::str(error.value()).cast<std::string>() + ")");
  }
  const char kind = array.dtype().kind();
  const bool empty_list = array.size() == 0;
  if (kind != 'f' && kind != 'i' && kind != 'u' && !empty_list) {
    refuse(what, "an array of " + typeOf(array) + " of shape " + shapeOf(array), "numbers");
  }
  return array;
}

std::string shapeOf(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t n = 0; n < array.ndim(); ++n) text += (n ? ", " : "") + std::to_string(array.shape(n));
  return text + ")";
}

Eigen::Matrix3Xi trianglesOf(const py::handle& value) {
  const char* const what = "triangles";
  const py::array array = numbers(value, what);
  if (array.ndim() != 2 || array.shape(1) != 3) {
    refuse(what, "an array of shape " + shapeOf(array), "(m, 3)");
  }
  const char kind = array.dtype().kind();
  if (kind != 'i' && kind != 'u' && array.size() > 0) {
    refuse(what, "an array of " + typeOf(array), "integers, indices of the vertices");
  }
  const Array<std::int64_t> wide = py::cast<Array<std::int64_t>>(array);
  const Eigen::Map<const Eigen::Matrix<std::int64_t, 3, Eigen::Dynamic>> indices(wide.data(), 3,
                                                                                 wide.shape(0));
  // What uint64 cannot bring into int64 is negative here.
  if (indices.size() > 0 &&
      (indices.minCoeff() < 0 || indices.maxCoeff() > std::numeric_limits<int>::max())) {
    refuse(what,
           "indices from " + std::to_string(indices.minCoeff()) + " to " + std::to_string(indices.maxCoeff()),
           "those of vertices, from 0");
  }
  return indices.cast<int>();
}

Eigen::Isometry3d poseOf(const py::handle& value, const char* what) {
  const Array<double> array = shaped(value, what, 4, 4);
  try {
    return orthonormalized(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(array.data()));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string(what) + ": " + error.what());
  }
}

Eigen::Vector3d vectorOf(const py::handle& value, const char* what) {
  const Array<double> array = shaped(value, what, 3, 0);
  const Eigen::Vector3d vector = Eigen::Map<const Eigen::Vector3d>(array.data());
  if (!vector.allFinite()) refuse(what, "NaN or infinity", "three finite numbers");
  return vector;
}

Eigen::Vector3d directionOf(const py::handle& value, const char* what) {
  const Eigen::Vector3d vector = vectorOf(value, what);
  if (!(vector.norm() > 0.0)) refuse(what, "a vector of length 0", "a direction");
  return vector;
}

CameraIntrinsics intrinsicsOf(const py::handle& value) {
  const char* const what = "intrinsics";
  const Array<double> k = py::cast<Array<double>>(numbers(value, what));
  CameraIntrinsics camera;
  if (k.ndim() == 1 && k.shape(0) == 4) {
    camera.fx = k.at(0), camera.fy = k.at(1), camera.cx = k.at(2), camera.cy = k.at(3);
  } else if (k.ndim() == 2 && k.shape(0) >= 3 && k.shape(0) <= 4 && k.shape(1) >= 3 && k.shape(1) <= 4) {
    camera.fx = k.at(0, 0), camera.fy = k.at(1, 1), camera.cx = k.at(0, 2), camera.cy = k.at(1, 2);
    constexpr double kLargestSkew = 1e-3;  // of the focal length
    const bool matrix = std::abs(k.at(0, 1)) <= kLargestSkew * std::abs(camera.fx) && k.at(1, 0) == 0.0 &&
                        k.at(2, 0) == 0.0 && k.at(2, 1) == 0.0 && k.at(2, 2) == 1.0;
    if (!matrix) {
      refuse(what, "a matrix " + py::str(py::handle(k)).cast<std::string>(),
             "fx 0 cx, 0 fy cy, 0 0 1 (row by row, not transposed, without skew)");
    }
  } else {
    refuse(what, "an array of shape " + shapeOf(k), "(3, 3) or fx, fy, cx, cy");
  }
  return camera;
}

DepthImage depthOf(const py::handle& value, double depth_scale) {
  const char* const what = "depth image";
  const py::array array = numbers(value, what);
  if (array.ndim() != 2) refuse(what, "an array of shape " + shapeOf(array), "(height, width)");
  if (array.size() == 0 || array.shape(0) > std::numeric_limits<int>::max() ||
      array.shape(1) > std::numeric_limits<int>::max()) {
    refuse(what, "an array of shape " + shapeOf(array), "(height, width) with pixels");
  }
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

std::string pathOf(const py::handle& value) {
  PyObject* bytes = nullptr;
  if (!PyUnicode_FSConverter(value.ptr(), &bytes)) throw py::error_already_set();
  return py::reinterpret_steal<py::bytes>(bytes).cast<std::string>();
}

std::string optionText(const py::handle& value) {
  const bool truth =
      py::isinstance<py::bool_>(value) || py::isinstance(value, py::module::import("numpy").attr("bool_"));
  if (truth) return py::bool_(py::reinterpret_borrow<py::object>(value)) ? "true" : "false";
  return py::str(value).cast<std::string>();
}

void refuseRest(const py::dict& keywords) {
  for (const auto& item : keywords) {
    throw std::invalid_argument("option '" + item.first.cast<std::string>() + "': unknown");
  }
}

}  // namespace ttsdf::python

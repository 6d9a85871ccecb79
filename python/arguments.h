#pragma once
// Arguments as Python has them: arrays of any layout and byte order, paths, options. What is not what it
// should be is refused instead of cast. And the way back to numpy.

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "ttsdf_localization/frames/depth_image.h"
#include "ttsdf_localization/options/option_table.h"

namespace ttsdf::python {

namespace py = pybind11;

/// Contiguous and of the machine's byte order.
template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

/// Anything numpy makes an array of, if it holds real numbers. Throws std::invalid_argument naming `what`:
/// texts, objects, complex numbers, truth values, masked arrays.
py::array numbers(const py::handle& value, const char* what);
std::string shapeOf(const py::array& array);

/// (n, 3) numbers; `points` seen as 3 x n without a copy: numpy's rows are Eigen's columns.
template <class T>
class Rows {
 public:
  Rows(const py::handle& value, const char* what) : array_(checked(value, what)) {}
  Eigen::Map<const Eigen::Matrix<T, 3, Eigen::Dynamic>> columns() const {
    return {array_.data(), 3, array_.shape(0)};
  }

 private:
  static Array<T> checked(const py::handle& value, const char* what) {
    const py::array array = numbers(value, what);
    if (array.ndim() != 2 || array.shape(1) != 3) {
      throw std::invalid_argument(std::string(what) + ": got an array of shape " + shapeOf(array) +
                                  ", wanted (n, 3)");
    }
    return py::cast<Array<T>>(array);
  }
  Array<T> array_;
};

/// (m, 3) whole numbers. Throws for other numbers and for those that an int cannot hold.
Eigen::Matrix3Xi trianglesOf(const py::handle& value);
/// A rigid motion, (4, 4).
Eigen::Isometry3d poseOf(const py::handle& value, const char* what);
/// Three finite numbers.
Eigen::Vector3d vectorOf(const py::handle& value, const char* what);
/// The same, and not all 0.
Eigen::Vector3d directionOf(const py::handle& value, const char* what);
/// A matrix of intrinsics, (3, 3) to (4, 4), or fx, fy, cx, cy. Width and height are left alone.
CameraIntrinsics intrinsicsOf(const py::handle& value);
/// (height, width): integers are divided by depth_scale, floats are metres.
DepthImage depthOf(const py::handle& value, double depth_scale);
/// str, bytes or os.PathLike.
std::string pathOf(const py::handle& value);

/// Hands a matrix to numpy as n x 3, without a copy: the capsule owns it.
template <class Matrix>
py::array asRows(Matrix&& matrix) {
  using Owned = std::decay_t<Matrix>;
  using T = typename Owned::Scalar;
  auto* owned = new Owned(std::forward<Matrix>(matrix));
  const py::capsule owner(owned, [](void* p) { delete static_cast<Owned*>(p); });
  return py::array_t<T>({owned->cols(), owned->rows()}, owned->data(), owner);
}

/// An option's value as the tables read it.
std::string optionText(const py::handle& value);
/// Moves the keywords that a table knows into its options.
template <class Options>
void take(py::dict& keywords, const OptionTable<Options>& table, Options& options) {
  py::dict rest;
  for (const auto& item : keywords) {
    const auto name = item.first.cast<std::string>();
    if (table.has(name)) {
      table.setFromText(options, name, optionText(item.second));
    } else {
      rest[item.first] = item.second;
    }
  }
  keywords = rest;
}
void refuseRest(const py::dict& keywords);

}  // namespace ttsdf::python

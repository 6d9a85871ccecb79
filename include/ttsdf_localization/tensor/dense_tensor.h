#pragma once
// A dense three-dimensional array of float, first index fastest: entry (i, j, k) is data[i + n0 * (j + n1 *
// k)]. The mode-1 unfolding is therefore the raw memory seen as a column-major n0 x (n1 n2) matrix.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace ttsdf {

using Dims = Eigen::Array3i;

class DenseTensor {
 public:
  DenseTensor() = default;
  /// All entries `value`. Throws std::invalid_argument if an extent is below 1.
  explicit DenseTensor(const Dims& dims, float value = 0.0f);

  const Dims& dims() const { return dims_; }
  std::size_t size() const { return data_.size(); }
  float* data() { return data_.data(); }
  const float* data() const { return data_.data(); }

  std::size_t offset(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(dims_[0]) *
               (static_cast<std::size_t>(j) +
                static_cast<std::size_t>(dims_[1]) * static_cast<std::size_t>(k));
  }
  float& operator()(int i, int j, int k) { return data_[offset(i, j, k)]; }
  float operator()(int i, int j, int k) const { return data_[offset(i, j, k)]; }

 private:
  Dims dims_ = Dims::Zero();
  std::vector<float> data_;
};

}  // namespace ttsdf

#include "ttsdf_localization/tensor/tensor_train.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace ttsdf {

namespace {

/// D of the paper's equation (finitediff), signs corrected.
Eigen::MatrixXf differenceMatrix(int n, double step) {
  Eigen::MatrixXf D = Eigen::MatrixXf::Zero(n, n);
  const auto h = static_cast<float>(1.0 / step);
  if (n == 1) return D;
  if (n == 2) {
    D << -h, h, -h, h;
    return D;
  }
  for (int k = 1; k + 1 < n; ++k) {
    D(k, k - 1) = -0.5f * h;
    D(k, k + 1) = 0.5f * h;
  }
  D(0, 0) = -1.5f * h, D(0, 1) = 2.0f * h, D(0, 2) = -0.5f * h;
  D(n - 1, n - 3) = 0.5f * h, D(n - 1, n - 2) = -2.0f * h, D(n - 1, n - 1) = 1.5f * h;
  return D;
}

int modeOf(const ModeOrder& axes, int axis) {
  for (int mode = 0; mode < 3; ++mode) {
    if (axes[static_cast<std::size_t>(mode)] == axis) return mode;
  }
  throw std::invalid_argument("tensor train: got axis " + std::to_string(axis) + ", wanted 0, 1 or 2");
}

}  // namespace

ModeOrder defaultModeOrder(const Dims& dims) {
  int middle = 0;
  dims.minCoeff(&middle);
  switch (middle) {
    case 0:
      return {{1, 0, 2}};
    case 1:
      return {{0, 1, 2}};
    default:
      return {{0, 2, 1}};
  }
}

TensorTrain::TensorTrain(ModeOrder axes, Eigen::MatrixXf first, Eigen::MatrixXf middle, Eigen::MatrixXf last)
    : axes_(axes), first_(std::move(first)), middle_(std::move(middle)), last_(std::move(last)) {
  ModeOrder sorted = axes_;
  std::sort(sorted.begin(), sorted.end());
  const bool permutation = sorted == ModeOrder{{0, 1, 2}};
  const bool shapes = first_.rows() > 0 && first_.cols() > 0 && last_.rows() > 0 && last_.cols() > 0 &&
                      middle_.rows() == first_.cols() && middle_.cols() > 0 &&
                      middle_.cols() % last_.rows() == 0;
  if (permutation && shapes) return;
  std::ostringstream text;
  text << "tensor train: got axes " << axes_[0] << axes_[1] << axes_[2] << " and cores " << first_.rows()
       << "x" << first_.cols() << ", " << middle_.rows() << "x" << middle_.cols() << ", " << last_.rows()
       << "x" << last_.cols() << ", wanted a permutation of 012 and n1 x r1, r1 x (n2 r2), r2 x n3";
  throw std::invalid_argument(text.str());
}

std::array<int, 3> TensorTrain::modeSizes() const {
  const auto r2 = last_.rows();
  return {{static_cast<int>(first_.rows()), r2 == 0 ? 0 : static_cast<int>(middle_.cols() / r2),
           static_cast<int>(last_.cols())}};
}

Dims TensorTrain::dims() const {
  const auto sizes = modeSizes();
  Dims dims;
  for (std::size_t mode = 0; mode < 3; ++mode) dims[axes_[mode]] = sizes[mode];
  return dims;
}

float TensorTrain::operator()(int x, int y, int z) const {
  const std::array<int, 3> array_index{{x, y, z}};
  const int i = array_index[static_cast<std::size_t>(axes_[0])];
  const int j = array_index[static_cast<std::size_t>(axes_[1])];
  const int k = array_index[static_cast<std::size_t>(axes_[2])];
  return (first_.row(i) * slice(j)).dot(last_.col(k).transpose());
}

std::size_t TensorTrain::parameterCount() const {
  return static_cast<std::size_t>(first_.size() + middle_.size() + last_.size());
}

DenseTensor full(const TensorTrain& tt) {
  DenseTensor tensor(tt.dims());
  const auto sizes = tt.modeSizes();
  std::array<int, 3> index{};
  for (int j = 0; j < sizes[1]; ++j) {
    const Eigen::MatrixXf slab = tt.first() * tt.slice(j) * tt.last();
    index[static_cast<std::size_t>(tt.axes()[1])] = j;
    for (int k = 0; k < sizes[2]; ++k) {
      index[static_cast<std::size_t>(tt.axes()[2])] = k;
      for (int i = 0; i < sizes[0]; ++i) {
        index[static_cast<std::size_t>(tt.axes()[0])] = i;
        tensor(index[0], index[1], index[2]) = slab(i, k);
      }
    }
  }
  return tensor;
}

TensorTrain applyToMode(const TensorTrain& tt, int axis, const Eigen::MatrixXf& matrix) {
  const int mode = modeOf(tt.axes(), axis);
  const int n = tt.modeSizes()[static_cast<std::size_t>(mode)];
  if (matrix.cols() != n || matrix.rows() < 1) {
    std::ostringstream text;
    text << "applyToMode: got a " << matrix.rows() << "x" << matrix.cols() << " matrix, wanted m x " << n;
    throw std::invalid_argument(text.str());
  }
  if (mode == 0) return TensorTrain(tt.axes(), matrix * tt.first(), tt.middle(), tt.last());
  if (mode == 2) return TensorTrain(tt.axes(), tt.first(), tt.middle(), tt.last() * matrix.transpose());
  const Eigen::Index r2 = tt.rank2();
  Eigen::MatrixXf middle = Eigen::MatrixXf::Zero(tt.rank1(), matrix.rows() * r2);
  for (Eigen::Index a = 0; a < matrix.rows(); ++a) {
    for (int b = 0; b < n; ++b) {
      if (matrix(a, b) != 0.0f) middle.middleCols(a * r2, r2) += matrix(a, b) * tt.slice(b);
    }
  }
  return TensorTrain(tt.axes(), tt.first(), std::move(middle), tt.last());
}

TensorTrain differentiate(const TensorTrain& tt, int axis, double step) {
  if (!(step > 0.0))
    throw std::invalid_argument("differentiate: got step " + std::to_string(step) + ", wanted > 0");
  const auto mode = static_cast<std::size_t>(modeOf(tt.axes(), axis));
  return applyToMode(tt, axis, differenceMatrix(tt.modeSizes()[mode], step));
}

TensorTrain add(const TensorTrain& a, const TensorTrain& b) {
  if ((a.dims() != b.dims()).any() || a.axes() != b.axes()) {
    std::ostringstream text;
    text << "add: got trains of extents " << a.dims().transpose() << " and " << b.dims().transpose()
         << ", wanted equal extents and mode orders";
    throw std::invalid_argument(text.str());
  }
  const auto sizes = a.modeSizes();
  const Eigen::Index r1a = a.rank1(), r1b = b.rank1(), r2a = a.rank2(), r2b = b.rank2();
  Eigen::MatrixXf first(sizes[0], r1a + r1b);
  first << a.first(), b.first();
  Eigen::MatrixXf last(r2a + r2b, sizes[2]);
  last << a.last(), b.last();
  Eigen::MatrixXf middle = Eigen::MatrixXf::Zero(r1a + r1b, sizes[1] * (r2a + r2b));
  for (int j = 0; j < sizes[1]; ++j) {
    const Eigen::Index column = j * (r2a + r2b);
    middle.block(0, column, r1a, r2a) = a.slice(j);
    middle.block(r1a, column + r2a, r1b, r2b) = b.slice(j);
  }
  return TensorTrain(a.axes(), std::move(first), std::move(middle), std::move(last));
}

TensorTrain scale(const TensorTrain& tt, float factor) {
  return TensorTrain(tt.axes(), tt.first(), factor * tt.middle(), tt.last());
}

TensorTrain crop(const TensorTrain& tt, const Dims& begin, const Dims& size) {
  if ((begin < 0).any() || (size < 1).any() || (size > tt.dims() - begin).any()) {
    std::ostringstream text;
    text << "crop: got begin " << begin.transpose() << " and size " << size.transpose()
         << ", wanted a box inside " << tt.dims().transpose();
    throw std::invalid_argument(text.str());
  }
  const auto& axes = tt.axes();
  const Eigen::Index r2 = tt.rank2();
  return TensorTrain(axes, tt.first().middleRows(begin[axes[0]], size[axes[0]]),
                     tt.middle().middleCols(begin[axes[1]] * r2, size[axes[1]] * r2),
                     tt.last().middleCols(begin[axes[2]], size[axes[2]]));
}

double norm(const TensorTrain& tt) {
  const Eigen::MatrixXd gram1 = tt.first().cast<double>().transpose() * tt.first().cast<double>();
  const Eigen::MatrixXd gram3 = tt.last().cast<double>() * tt.last().cast<double>().transpose();
  double sum = 0.0;
  for (int j = 0; j < tt.modeSizes()[1]; ++j) {
    const Eigen::MatrixXd slice = tt.slice(j).cast<double>();
    sum += (gram1 * slice * gram3).cwiseProduct(slice).sum();
  }
  return std::sqrt(std::max(0.0, sum));
}

}  // namespace ttsdf

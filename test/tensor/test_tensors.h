#pragma once
// Tensors for the tests of the tensor train: made of analytic functions, so that every entry is known.

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf::test {

inline DenseTensor tabulate(const Dims& dims, const std::function<double(int, int, int)>& f) {
  DenseTensor tensor(dims);
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) tensor(i, j, k) = static_cast<float>(f(i, j, k));
    }
  }
  return tensor;
}

/// A distance field of two spheres and a plane: smooth but of full rank, as real maps are.
inline DenseTensor distanceTensor(const Dims& dims) {
  const Eigen::Vector3d size = dims.cast<double>();
  const double length = size.maxCoeff();
  return tabulate(dims, [&](int i, int j, int k) {
    const Eigen::Vector3d p(i, j, k);
    const double first = (p - 0.3 * size).norm() - 0.2 * length;
    const double second = (p - 0.75 * size).norm() - 0.15 * length;
    return std::min({first, second, 0.7 * i + 0.1 * j - 0.2 * k + 2.0}) / length;
  });
}

/// Entries without any structure.
inline DenseTensor noiseTensor(const Dims& dims, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  return tabulate(dims, [&](int, int, int) { return normal(random); });
}

inline Eigen::MatrixXf randomMatrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  return Eigen::MatrixXf::NullaryExpr(rows, columns, [&] { return normal(random); });
}

/// Chain extents n (n1, n2, n3), ranks r1, r2.
inline TensorTrain randomTrain(const ModeOrder& axes, const std::array<int, 3>& n, int r1, int r2,
                               unsigned seed = 1) {
  return TensorTrain(axes, randomMatrix(n[0], r1, seed), randomMatrix(r1, n[1] * r2, seed + 100),
                     randomMatrix(r2, n[2], seed + 200));
}

inline double norm(const DenseTensor& tensor) {
  double sum = 0.0;
  for (std::size_t n = 0; n < tensor.size(); ++n) sum += std::pow(tensor.data()[n], 2);
  return std::sqrt(sum);
}

inline double distance(const DenseTensor& a, const DenseTensor& b) {
  double sum = 0.0;
  for (std::size_t n = 0; n < a.size(); ++n)
    sum += std::pow(static_cast<double>(a.data()[n]) - b.data()[n], 2);
  return std::sqrt(sum);
}

/// |a - b| / |b|; |a| where b is zero.
inline double relativeError(const DenseTensor& a, const DenseTensor& b) {
  const double reference = norm(b);
  return reference > 0.0 ? distance(a, b) / reference : norm(a);
}

inline const std::vector<ModeOrder>& allModeOrders() {
  static const std::vector<ModeOrder> orders{{{0, 1, 2}}, {{0, 2, 1}}, {{1, 0, 2}},
                                             {{1, 2, 0}}, {{2, 0, 1}}, {{2, 1, 0}}};
  return orders;
}

/// The unfolding whose rows are the `left` modes of the chain and whose columns are the rest, in double.
inline Eigen::MatrixXd unfolding(const DenseTensor& tensor, const ModeOrder& axes, int left) {
  const Dims& dims = tensor.dims();
  const std::array<int, 3> n{{dims[axes[0]], dims[axes[1]], dims[axes[2]]}};
  Eigen::MatrixXd matrix(left == 1 ? n[0] : n[0] * n[1], left == 1 ? n[1] * n[2] : n[2]);
  std::array<int, 3> index{};
  for (int a = 0; a < n[0]; ++a) {
    for (int b = 0; b < n[1]; ++b) {
      for (int c = 0; c < n[2]; ++c) {
        index[static_cast<std::size_t>(axes[0])] = a;
        index[static_cast<std::size_t>(axes[1])] = b;
        index[static_cast<std::size_t>(axes[2])] = c;
        const double value = tensor(index[0], index[1], index[2]);
        if (left == 1) {
          matrix(a, b + n[1] * c) = value;
        } else {
          matrix(a + n[0] * b, c) = value;
        }
      }
    }
  }
  return matrix;
}

}  // namespace ttsdf::test

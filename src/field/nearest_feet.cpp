#include "nearest_feet.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace ttsdf {

NearestFeet::NearestFeet(const Dims& dims) : dims_(dims) {
  feet_.assign(linear(dims[0], dims[1], dims[2]) + 1, Eigen::Vector3f::Constant(kFar));
}

void NearestFeet::offer(int a, int b, int c, const Eigen::Vector3f& foot) {
  Eigen::Vector3f& own = feet_[linear(a, b, c)];
  const Eigen::Vector3f here(static_cast<float>(a), static_cast<float>(b), static_cast<float>(c));
  if ((foot - here).squaredNorm() < (own - here).squaredNorm()) own = foot;
}

void NearestFeet::add(const Eigen::Vector3f& foot) {
  const Eigen::Array3i low = foot.array().floor().cast<int>();
  for (int corner = 0; corner < 8; ++corner) {
    const int a = low[0] + (corner & 1), b = low[1] + (corner >> 1 & 1), c = low[2] + (corner >> 2);
    if (a < 0 || b < 0 || c < 0 || a >= dims_[0] || b >= dims_[1] || c >= dims_[2]) continue;
    offer(a, b, c, foot);
    empty_ = false;
  }
}

void NearestFeet::pass(int direction, const KeepGoing& keep_going) {
  const auto begin = [&](int axis) { return direction > 0 ? 0 : dims_[axis] - 1; };
  const auto inside = [&](int axis, int n) { return n >= 0 && n < dims_[axis]; };
  constexpr int kNeighbours = 13;  // that this pass has been to
  std::array<std::ptrdiff_t, kNeighbours> steps{};
  for (int n = 0; n < kNeighbours; ++n) {
    const std::ptrdiff_t rows = dims_[0] + 2, columns = dims_[1] + 2;
    steps[static_cast<std::size_t>(n)] =
        direction * (n % 3 - 1 + rows * (n / 3 % 3 - 1 + columns * (n / 9 - 1)));
  }
  for (int c = begin(2); inside(2, c); c += direction) {
    goOn(keep_going);
    for (int b = begin(1); inside(1, b); b += direction) {
      Eigen::Vector3f* own = &feet_[linear(begin(0), b, c)];
      for (int a = begin(0); inside(0, a); a += direction, own += direction) {
        const Eigen::Vector3f here(static_cast<float>(a), static_cast<float>(b), static_cast<float>(c));
        float best = (*own - here).squaredNorm();
        const Eigen::Vector3f* nearest = own;
        for (const std::ptrdiff_t step : steps) {
          const Eigen::Vector3f* const other = own + step;
          const float squared = (*other - here).squaredNorm();
          if (squared < best) best = squared, nearest = other;
        }
        *own = *nearest;
      }
    }
  }
}

void NearestFeet::spread(const KeepGoing& keep_going) {
  for (const int direction : {1, -1, 1, -1}) pass(direction, keep_going);
}

float NearestFeet::distance(int a, int b, int c) const {
  const Eigen::Vector3f here(static_cast<float>(a), static_cast<float>(b), static_cast<float>(c));
  return (feet_[linear(a, b, c)] - here).norm();
}

}  // namespace ttsdf

#include "nearest_feet.h"

#include <algorithm>
#include <cmath>

namespace ttsdf {

NearestFeet::NearestFeet(const Dims& dims) : dims_(dims) {
  feet_.assign(linear(0, 0, dims[2]), Eigen::Vector3f::Constant(kFar));
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
  for (int c = begin(2); inside(2, c); c += direction) {
    goOn(keep_going);
    for (int b = begin(1); inside(1, b); b += direction) {
      for (int a = begin(0); inside(0, a); a += direction) {
        Eigen::Vector3f& own = feet_[linear(a, b, c)];
        const Eigen::Vector3f here(static_cast<float>(a), static_cast<float>(b), static_cast<float>(c));
        float best = (own - here).squaredNorm();
        // The 13 neighbours that this pass has been to.
        for (int n = 0; n < 13; ++n) {
          const int da = direction * (n % 3 - 1), db = direction * (n / 3 % 3 - 1),
                    dc = direction * (n / 9 - 1);
          if (!inside(0, a + da) || !inside(1, b + db) || !inside(2, c + dc)) continue;
          const Eigen::Vector3f& other = feet_[linear(a + da, b + db, c + dc)];
          const float squared = (other - here).squaredNorm();
          if (squared < best) best = squared, own = other;
        }
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

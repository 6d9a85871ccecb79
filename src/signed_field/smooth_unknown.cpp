#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "../build_steps/parallel.h"
#include "hole_filling.h"
#include "ttsdf_localization/signed_field/signed_distance.h"

namespace ttsdf {
namespace {

constexpr float kJump = 2.5F;         // more between two neighbours is no course of a distance [voxel]
constexpr float kNearSurface = 2.0F;  // values smaller than this are the surface's own business [voxel]
constexpr int kJumpReach = 4;         // samples on either side of a jump that may give way

class JumpFinder {
 public:
  JumpFinder(SignedDistance& field, float voxel_size, int threads)
      : field_(field), dims_(field.values.dims()), voxel_size_(voxel_size), threads_(threads) {
    loose_.assign(field.values.size(), 0);
  }

  /// 1 where a value means nothing.
  std::vector<std::uint8_t> run() {
    for (std::size_t n = 0; n < loose_.size(); ++n)
      loose_[n] = !field_.known[n] && !field_.supported[n] ? 1 : 0;
    loosenJumps();
    return std::move(loose_);
  }

 private:
  std::size_t stride(int axis) const {
    const auto n0 = static_cast<std::size_t>(dims_[0]), n1 = static_cast<std::size_t>(dims_[1]);
    return axis == 0 ? 1 : (axis == 1 ? n0 : n0 * n1);
  }

  bool mayGiveWay(std::size_t n) const {
    return !field_.known[n] && std::abs(field_.values.data()[n]) > kNearSurface * voxel_size_;
  }

  template <class Function>
  void forEachNeighbour(std::size_t n, const Function& fn) const {
    for (int axis = 0; axis < 3; ++axis) fn(n - stride(axis)), fn(n + stride(axis));
  }

  /// Samples next to a jump, but for the grid's outermost.
  std::vector<std::size_t> findJumps() const {
    const float* values = field_.values.data();
    std::vector<std::vector<std::size_t>> found(static_cast<std::size_t>(std::max(0, dims_[2] - 2)));
    parallelFor(static_cast<int>(found.size()), threads_, [&](int slice) {
      for (int j = 1; j + 1 < dims_[1]; ++j) {
        std::size_t n = field_.values.offset(1, j, slice + 1);
        for (int i = 1; i + 1 < dims_[0]; ++i, ++n) {
          if (!mayGiveWay(n)) continue;
          float largest = 0.0F;
          forEachNeighbour(
              n, [&](std::size_t m) { largest = std::max(largest, std::abs(values[n] - values[m])); });
          if (largest > kJump * voxel_size_) found[static_cast<std::size_t>(slice)].push_back(n);
        }
      }
    });
    std::vector<std::size_t> jumps;
    for (const auto& slice : found) jumps.insert(jumps.end(), slice.begin(), slice.end());
    return jumps;
  }

  bool isInner(std::size_t n) const {
    const auto n0 = static_cast<std::size_t>(dims_[0]), n1 = static_cast<std::size_t>(dims_[1]);
    const auto between = [](std::size_t index, int size) {
      return index > 0 && index + 1 < static_cast<std::size_t>(size);
    };
    return between(n % n0, dims_[0]) && between(n / n0 % n1, dims_[1]) && between(n / n0 / n1, dims_[2]);
  }

  void loosenJumps() {
    std::vector<std::size_t> front = findJumps();
    const auto loosen = [this](std::size_t n) { loose_[n] = 1, field_.supported[n] = 0; };
    std::vector<std::uint8_t> reached(front.empty() ? 0 : loose_.size(), 0);
    for (const std::size_t n : front) reached[n] = 1, loosen(n);
    for (int step = 1; step < kJumpReach; ++step) {
      std::vector<std::size_t> next;
      for (const std::size_t n : front) {
        forEachNeighbour(n, [&](std::size_t m) {
          if (reached[m] || !mayGiveWay(m) || !isInner(m)) return;
          reached[m] = 1;
          next.push_back(m);
          loosen(m);
        });
      }
      front = std::move(next);
    }
  }

  SignedDistance& field_;
  Dims dims_;
  float voxel_size_;
  int threads_;
  std::vector<std::uint8_t> loose_;
};

}  // namespace

std::vector<std::uint8_t> looseSamples(SignedDistance& field, double voxel_size, int threads) {
  return JumpFinder(field, static_cast<float>(voxel_size), threads).run();
}

void smoothUnknown(SignedDistance& field, double voxel_size, int threads) {
  fillHoles(field.values, looseSamples(field, voxel_size, threads), threads);
}

}  // namespace ttsdf

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "hole_filling.h"
#include "parallel.h"
#include "ttsdf_localization/mapping/signed_distance.h"

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

  template <class Function>
  void forEachInner(const Function& fn) const {
    parallelFor(std::max(0, dims_[2] - 2), threads_, [&](int slice) {
      for (int j = 1; j + 1 < dims_[1]; ++j) {
        std::size_t n = field_.values.offset(1, j, slice + 1);
        for (int i = 1; i + 1 < dims_[0]; ++i, ++n) fn(n);
      }
    });
  }

  bool mayGiveWay(std::size_t n) const {
    return !field_.known[n] && std::abs(field_.values.data()[n]) > kNearSurface * voxel_size_;
  }

  void loosenJumps() {
    std::vector<std::uint8_t> front(loose_.size(), 0);
    const float* values = field_.values.data();
    forEachInner([&](std::size_t n) {
      if (!mayGiveWay(n)) return;
      for (int axis = 0; axis < 3; ++axis) {
        for (const std::size_t m : {n - stride(axis), n + stride(axis)}) {
          if (std::abs(values[n] - values[m]) > kJump * voxel_size_) front[n] = 1;
        }
      }
    });
    for (int step = 1; step < kJumpReach; ++step) {
      const std::vector<std::uint8_t> before = front;
      forEachInner([&](std::size_t n) {
        if (before[n] || !mayGiveWay(n)) return;
        for (int axis = 0; axis < 3; ++axis) {
          if (before[n - stride(axis)] || before[n + stride(axis)]) front[n] = 1;
        }
      });
    }
    forEachInner([&](std::size_t n) {
      if (!front[n]) return;
      loose_[n] = 1;
      field_.supported[n] = 0;
    });
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

#pragma once
// For every sample of a coarse grid the nearest surface point, found by handing it on from sample to sample.

#include <Eigen/Core>
#include <vector>

#include "ttsdf_localization/field/distance_field.h"

namespace ttsdf {

/// Positions in units of the grid's index, x fastest.
class NearestFeet {
 public:
  explicit NearestFeet(const Dims& dims);

  /// A surface point: the samples around it may have it as their nearest.
  void add(const Eigen::Vector3f& foot);
  bool empty() const { return empty_; }
  /// Hands the points on to all samples: four passes of 13 neighbours each.
  void spread(const KeepGoing& keep_going);
  /// Distance of a sample to its surface point.
  float distance(int a, int b, int c) const;

 private:
  static constexpr float kFar = 1e9f;

  /// A border of samples without a foot runs round the grid: no pass has to ask where it ends.
  std::size_t linear(int a, int b, int c) const {
    const auto rows = static_cast<std::size_t>(dims_[0] + 2),
               columns = static_cast<std::size_t>(dims_[1] + 2);
    return static_cast<std::size_t>(a + 1) +
           rows * (static_cast<std::size_t>(b + 1) + columns * static_cast<std::size_t>(c + 1));
  }
  void offer(int a, int b, int c, const Eigen::Vector3f& foot);
  void pass(int direction, const KeepGoing& keep_going);

  Dims dims_;
  std::vector<Eigen::Vector3f> feet_;
  bool empty_ = true;
};

}  // namespace ttsdf

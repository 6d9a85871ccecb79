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

  std::size_t linear(int a, int b, int c) const {
    return static_cast<std::size_t>(a) +
           static_cast<std::size_t>(dims_[0]) *
               (static_cast<std::size_t>(b) +
                static_cast<std::size_t>(dims_[1]) * static_cast<std::size_t>(c));
  }
  void offer(int a, int b, int c, const Eigen::Vector3f& foot);
  void pass(int direction, const KeepGoing& keep_going);

  Dims dims_;
  std::vector<Eigen::Vector3f> feet_;
  bool empty_ = true;
};

}  // namespace ttsdf

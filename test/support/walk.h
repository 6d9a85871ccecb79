#pragma once
// A localizer in the analytic room, and a walk through it.

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "room.h"
#include "ttsdf_localization/localization/localizer.h"
#include "ttsdf_localization/localization/pose_covariance.h"

namespace ttsdf::test {

inline std::shared_ptr<const DistanceField> roomField() {
  static const std::shared_ptr<const DistanceField> field = [] {
    GridGeometry geometry;
    DenseTensor tensor = sampleScene(Room(), 0.05, geometry);
    return std::make_shared<DenseDistanceField>(std::move(tensor), geometry);
  }();
  return field;
}

/// A camera that walks along a line through the room, seen at 10 Hz; the base is the camera.
struct Walk {
  double start = 100.0;
  Eigen::Isometry3d pose(double t) const {
    return cameraPose({1.6 + 0.3 * t, 1.2 + 0.2 * t, 1.2}, 0.5 + 0.2 * t, 0.1);
  }
  LocalizerScan scan(int n) const { return scanAt(n, pose(0.1 * n)); }
  LocalizerScan scanAt(int n, const Eigen::Isometry3d& T_map_camera) const {
    LocalizerScan scan;
    scan.stamp = start + 0.1 * n;
    scan.points = renderScan(Room(), T_map_camera);
    return scan;
  }
};

inline PoseGuess guessAt(const Eigen::Isometry3d& T, double rotation_sigma = 0.05,
                         double translation_sigma = 0.1) {
  PoseGuess guess;
  guess.T_map_base = T;
  guess.covariance = isotropicCovariance(rotation_sigma, translation_sigma);
  guess.source = "test";
  return guess;
}

inline LocalizerOptions quickOptions() {
  LocalizerOptions options;
  options.recovery.allow_global = false;
  return options;
}

/// A localizer that tracks the walk; `next` is the number of the next scan.
struct Tracking {
  explicit Tracking(const LocalizerOptions& options = quickOptions()) : localizer(options) {
    localizer.setMap(roomField());
    localizer.setGuess(guessAt(walk.pose(0.0)));
    for (; next < 6 && localizer.state() != LocalizerState::kTracking; ++next)
      last = localizer.process(walk.scan(next));
  }
  Walk walk;
  Localizer localizer;
  LocalizationUpdate last;
  int next = 0;
};

inline void expectNear(const Eigen::Isometry3d& got, const Eigen::Isometry3d& wanted, double translation,
                       double rotation) {
  const PoseError error = poseError(got, wanted);
  EXPECT_LT(error.translation, translation);
  EXPECT_LT(error.rotation, rotation);
}

}  // namespace ttsdf::test

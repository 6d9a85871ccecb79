#pragma once
// Whether depth frames agree with one another, told from a handful before an hour is spent; and, where they
// do not, which of the usual mistakes would explain it.

#include <functional>
#include <string>
#include <vector>

#include "ttsdf_localization/frames/frame_folder.h"

namespace ttsdf {

/// What a folder's frames say of one another, under some reading of them.
struct PairAgreement {
  double share = 0.0;      ///< of points that another frame sees where this one has them [0, 1]
  std::size_t points = 0;  ///< that were compared
};

struct FrameCheck {
  PairAgreement as_given;
  PairAgreement best;         ///< of the readings tried
  std::string best_change;    ///< what the best reading changes: "with the poses inverted"
  std::string best_option;    ///< and how to say so: "--poses world-to-camera"
  bool best_mirrors = false;  ///< it turns an axis round
  double in_range = 1.0;      ///< share of the readings within [min_depth, max_depth]
  double median_depth = 0.0;  ///< [m]

  enum class Verdict { kGood, kDoubtful, kNonsense, kTooLittle };
  Verdict verdict() const;
  /// One line with the figures and what would agree.
  std::string message() const;
};

struct FrameCheckOptions {
  double min_depth = 0.2, max_depth = 4.0;  ///< [m]
  std::size_t pairs = 16;                   ///< of frames that are compared
};

/// Compares pairs of frames all over the sequence, each with one that was taken from elsewhere. Frames that
/// cannot be read are left out.
FrameCheck checkFrames(const FrameFolder& folder, const FrameFolderOptions& given,
                       const std::vector<FrameEntry>& frames, const FrameCheckOptions& options = {});

/// Frames whose camera stands far from all others, by name, with the distance [m].
std::vector<std::pair<std::size_t, double>> strayPoses(const std::vector<Eigen::Isometry3d>& poses);

}  // namespace ttsdf

#pragma once
// Which scans of a stream are worth fusing: a camera that stands still adds nothing but time.

#include <Eigen/Geometry>
#include <optional>

#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct ScanSelectionOptions {
  int every = 1;                 ///< take every n-th scan
  double min_interval = 0.0;     ///< time since the last scan taken [s]
  double min_translation = 0.0;  ///< motion since the last scan taken [m]; 0: motion does not matter ...
  double min_rotation = 0.0;     ///< [rad]; ... and 0 here: only translation counts
};
const OptionTable<ScanSelectionOptions>& scanSelectionOptionTable();

class ScanSelector {
 public:
  /// Throws std::invalid_argument for an option out of range.
  explicit ScanSelector(const ScanSelectionOptions& options = {});

  /// Call for every scan, in the order they come. A stamp [s] before the last one taken means that the clock
  /// was set back (a bag that loops): selection starts anew, or no scan would ever be taken again.
  bool take(double stamp, const Eigen::Isometry3d& T_map_sensor);
  void reset();

 private:
  bool movedEnough(const Eigen::Isometry3d& T_map_sensor) const;

  ScanSelectionOptions options_;
  int count_ = 0;
  std::optional<double> last_stamp_;
  Eigen::Isometry3d T_map_last_ = Eigen::Isometry3d::Identity();
};

}  // namespace ttsdf

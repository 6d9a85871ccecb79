#include "ros/scans/scan_selector.h"

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

const OptionTable<ScanSelectionOptions>& scanSelectionOptionTable() {
  using Options = ScanSelectionOptions;
  static const OptionTable<Options> table =
      OptionTable<Options>()
          .add("every", &Options::every, 1, 100000, "", "Take every n-th cloud.")
          .add("min_interval", &Options::min_interval, 0.0, 3600.0, "s",
               "Least time since the last cloud taken.")
          .add("min_translation", &Options::min_translation, 0.0, 100.0, "m",
               "Take a cloud when the sensor moved this far since the last one taken ... (0 with "
               "min_rotation 0: "
               "always.)")
          .add("min_rotation", &Options::min_rotation, 0.0, 3.2, "rad",
               "... or turned this far. (0 with min_translation 0: always.)");
  return table;
}

ScanSelector::ScanSelector(const ScanSelectionOptions& options) : options_(options) {
  scanSelectionOptionTable().validate(options);
}

bool ScanSelector::movedEnough(const Eigen::Isometry3d& T_map_sensor) const {
  if (options_.min_translation <= 0.0 && options_.min_rotation <= 0.0) return true;
  const PoseError motion = poseError(T_map_last_, T_map_sensor);
  return (options_.min_translation > 0.0 && motion.translation >= options_.min_translation) ||
         (options_.min_rotation > 0.0 && motion.rotation >= options_.min_rotation);
}

bool ScanSelector::take(double stamp, const Eigen::Isometry3d& T_map_sensor) {
  if (last_stamp_ && stamp < *last_stamp_) reset();
  if (count_++ % options_.every != 0) return false;
  if (last_stamp_ && (stamp - *last_stamp_ < options_.min_interval || !movedEnough(T_map_sensor)))
    return false;
  last_stamp_ = stamp;
  T_map_last_ = T_map_sensor;
  return true;
}

void ScanSelector::reset() {
  count_ = 0;
  last_stamp_.reset();
}

}  // namespace ttsdf

#pragma once
// /diagnostics: state and fit, scans, transforms, map.

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>

#include <string>

#include "ttsdf_localization/LocalizationStatus.h"
#include "ttsdf_localization/ros/cloud_input.h"

namespace ttsdf {

/// What the tasks report; filled by the node before every update.
struct DiagnosticsSnapshot {
  ttsdf_localization::LocalizationStatus status;
  CloudCounts clouds;
  std::string cloud_topic;
  std::string why_waiting;  ///< empty, or why the newest cloud waits for its transforms
  std::string map_summary;
  double quiet_limit = 15.0;  ///< [s]
  double tf_age = -1.0;       ///< clock - stamp of the last transform sent [s]; negative: ahead of the clock
  bool tf_active = false;
  bool tf_wanted = true;
  std::string tf_frames;  ///< "map -> odom"
};

/// Three tasks: "localization", "scans", "transforms" (doc/interface.md). Not thread-safe.
class LocalizationDiagnostics {
 public:
  LocalizationDiagnostics(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                          const std::string& name);
  void update(const DiagnosticsSnapshot& snapshot);

 private:
  using Wrapper = diagnostic_updater::DiagnosticStatusWrapper;
  void localization(Wrapper& out) const;
  void scans(Wrapper& out);
  void transforms(Wrapper& out) const;

  DiagnosticsSnapshot snapshot_;
  ros::WallTime last_rate_time_;
  std::uint32_t last_received_ = 0;
  double rate_ = 0.0;  ///< clouds [Hz]
  diagnostic_updater::Updater updater_;
};

}  // namespace ttsdf

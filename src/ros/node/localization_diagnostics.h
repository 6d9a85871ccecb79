#pragma once
// /diagnostics: state and fit, scans, transforms, map.

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>

#include <optional>
#include <string>

#include "ros/node/localization_pipeline.h"
#include "ttsdf_localization/atlas/atlas_loader.h"

namespace ttsdf {

/// Three tasks: "localization", "scans", "transforms" (doc/interface.md). Not thread-safe.
class LocalizationDiagnostics {
 public:
  LocalizationDiagnostics(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                          const std::string& name);
  /// `waiting`: why scans do not get on, or empty.
  void update(const LocalizationPipeline::View& view, const std::string& scan_topic, double quiet_limit,
              const std::string& waiting);
  /// Adds a task "atlas" at the first call.
  void setAtlas(const AtlasLoaderStatus& status);

 private:
  using Wrapper = diagnostic_updater::DiagnosticStatusWrapper;
  void localization(Wrapper& out) const;
  void scans(Wrapper& out);
  void transforms(Wrapper& out) const;
  void atlas(Wrapper& out) const;

  std::optional<AtlasLoaderStatus> atlas_;

  LocalizationPipeline::View view_;
  std::string scan_topic_, waiting_;
  double quiet_limit_ = 15.0;  ///< [s]
  ros::WallTime last_rate_time_;
  std::uint32_t last_received_ = 0;
  double rate_ = 0.0;  ///< clouds [Hz]
  diagnostic_updater::Updater updater_;
};

}  // namespace ttsdf

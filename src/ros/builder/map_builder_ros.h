#pragma once
// The map builder as a node: clouds and TF in, a compressed map out, on request. Fusion and building run in
// threads of their own, so clouds are queued (and, if too many, dropped and counted) while a map is
// compressed.

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <string>

#include "ros/builder/fusion_checkpoint.h"
#include "ros/builder/map_build_request.h"
#include "ros/builder/map_builder_options.h"
#include "ros/builder/map_views.h"
#include "ros/builder/posed_cloud_source.h"
#include "ros/builder/scan_fuser.h"
#include "ros/builder/silence_warning.h"
#include "ros/server/map_publisher.h"
#include "ttsdf_localization/BuildMap.h"
#include "ttsdf_localization/BuildProgress.h"
#include "ttsdf_localization/LoadMap.h"
#include "ttsdf_localization/SaveMap.h"

namespace ttsdf {

class MapBuilderRos {
 public:
  /// Topics and get_map in `nh`, the rest and the parameters in `private_nh`. Throws std::invalid_argument
  /// for bad parameters, std::runtime_error for a map_file that cannot be used.
  MapBuilderRos(ros::NodeHandle nh, ros::NodeHandle private_nh);
  /// Cancels a running build.
  ~MapBuilderRos();
  MapBuilderRos(const MapBuilderRos&) = delete;
  MapBuilderRos& operator=(const MapBuilderRos&) = delete;

 private:
  bool buildMap(ttsdf_localization::BuildMap::Request& request,
                ttsdf_localization::BuildMap::Response& response);
  bool saveMap(ttsdf_localization::SaveMap::Request& request,
               ttsdf_localization::SaveMap::Response& response);
  bool loadMap(ttsdf_localization::LoadMap::Request& request,
               ttsdf_localization::LoadMap::Response& response);
  bool reset(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);

  BuiltMap build(const ttsdf_localization::BuildMap::Request& request);
  BuiltMap buildFromFused(const BuildOptions& options, const BuildProgress& progress);
  BuiltMap compressed(SampledSource source, const BuildOptions& options, const BuildProgress& progress);
  void use(std::vector<std::uint8_t> bytes);
  std::string allowedPath(const std::string& field, const std::string& path) const;

  bool cancelled() const { return cancel_ || stopping_ || !ros::ok(); }

  void advertise();
  void publishProgress();
  void reportStep(const std::string& step, double share);
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status);

  const MapBuilderRosOptions options_;
  ros::NodeHandle nh_, private_nh_;
  /// Services take seconds: they have a queue and threads of their own, so that clouds still come in.
  ros::CallbackQueue service_queue_;
  ros::NodeHandle service_nh_, private_service_nh_;

  std::atomic<bool> building_{false};  ///< one build at a time
  std::atomic<bool> cancel_{false}, stopping_{false};

  std::mutex progress_mutex_;
  std::string step_ = "fusing";
  double share_ = 0.0;
  ttsdf_localization::BuildProgress last_progress_;  ///< as published

  std::unique_ptr<MapPublisher> map_;
  std::unique_ptr<MapViews> views_;
  ros::Publisher progress_;
  SilenceWarning silence_;
  std::vector<ros::ServiceServer> services_;
  FusionCheckpoint checkpoint_;
  std::unique_ptr<ScanFuser> fuser_;
  std::unique_ptr<PosedCloudSource> source_;
  diagnostic_updater::Updater diagnostics_;
  ros::WallTimer surface_timer_, progress_timer_, diagnostics_timer_, checkpoint_timer_;
  std::unique_ptr<ros::AsyncSpinner> service_spinner_;
};

/// For a node that refuses to start: a latched ~progress whose step says why.
ros::Publisher publishBuilderStartError(ros::NodeHandle private_nh, const std::string& message);

}  // namespace ttsdf

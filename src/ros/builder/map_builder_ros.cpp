#include "ros/builder/map_builder_ros.h"

#include <stdexcept>
#include <utility>

#include "ros/builder/map_build_request.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

namespace {

constexpr double kProgressPeriod = 0.1;  ///< news are sent this often [s]

}  // namespace

MapBuilderRos::MapBuilderRos(ros::NodeHandle nh, ros::NodeHandle private_nh)
    : options_(loadMapBuilderOptions(private_nh)),
      nh_(nh),
      private_nh_(private_nh),
      service_nh_(nh),
      private_service_nh_(private_nh),
      silence_(options_.quiet_seconds, options_.global_frame_id),
      checkpoint_(options_.checkpoint_file, options_.fusion),
      diagnostics_(nh, private_nh, private_nh.getNamespace()) {
  service_nh_.setCallbackQueue(&service_queue_);
  private_service_nh_.setCallbackQueue(&service_queue_);
  advertise();
  if (!options_.map_file.empty()) use(readFile(options_.map_file));

  fuser_ = std::make_unique<ScanFuser>(options_.fusion, options_.queue, checkpoint_.read());
  source_ = std::make_unique<PosedCloudSource>(
      nh_, options_.global_frame_id, options_.selection, options_.queue.queue_size,
      [this](const sensor_msgs::PointCloud2ConstPtr& cloud, const Eigen::Isometry3d& T_map_sensor) {
        fuser_->push(cloud, T_map_sensor);
      });
  if (options_.surface_period > 0.0) {
    surface_timer_ = service_nh_.createWallTimer(ros::WallDuration(options_.surface_period),
                                                 [this](const ros::WallTimerEvent&) {
                                                   // The surface of a map that is being built comes soon.
                                                   if (!building_) views_->showFused(*fuser_);
                                                 });
  }
  if (checkpoint_.kept()) {
    checkpoint_timer_ =
        service_nh_.createWallTimer(ros::WallDuration(options_.checkpoint_period),
                                    [this](const ros::WallTimerEvent&) { checkpoint_.write(*fuser_); });
  }
  diagnostics_.setHardwareID("none");
  diagnostics_.add("map builder", this, &MapBuilderRos::diagnose);
  diagnostics_timer_ = nh_.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) {
    diagnostics_.force_update();
    silence_.warn(*source_);
  });
  progress_timer_ = service_nh_.createWallTimer(ros::WallDuration(kProgressPeriod),
                                                [this](const ros::WallTimerEvent&) { publishProgress(); });
  publishProgress();
  // Several threads: a second request gets its answer ("busy", a reset) while the first is at work.
  service_spinner_ = std::make_unique<ros::AsyncSpinner>(3, &service_queue_);
  service_spinner_->start();
}

MapBuilderRos::~MapBuilderRos() {
  stopping_ = true;
  for (auto* timer : {&diagnostics_timer_, &progress_timer_, &surface_timer_, &checkpoint_timer_})
    timer->stop();
  for (auto& service : services_) service.shutdown();
  service_spinner_.reset();
  source_.reset();  // before the fuser, to which it hands clouds
  checkpoint_.write(*fuser_);
}

void MapBuilderRos::advertise() {
  progress_ = private_nh_.advertise<ttsdf_localization::BuildProgress>("progress", 1, true);
  map_ = std::make_unique<MapPublisher>(service_nh_);
  views_ = std::make_unique<MapViews>(private_service_nh_, options_, *map_);
  services_ = {private_service_nh_.advertiseService("build_map", &MapBuilderRos::buildMap, this),
               private_service_nh_.advertiseService("save_map", &MapBuilderRos::saveMap, this),
               private_service_nh_.advertiseService("load_map", &MapBuilderRos::loadMap, this),
               private_service_nh_.advertiseService("reset", &MapBuilderRos::reset, this)};
}

// ---- services ----

bool MapBuilderRos::buildMap(ttsdf_localization::BuildMap::Request& request,
                             ttsdf_localization::BuildMap::Response& response) {
  if (building_.exchange(true)) {
    response.message = "another build is running";
    return true;
  }
  const std::unique_ptr<std::atomic<bool>, void (*)(std::atomic<bool>*)> done(
      &building_, [](std::atomic<bool>* building) { *building = false; });
  cancel_ = false;
  try {
    const std::string filename =
        request.filename.empty() ? std::string() : allowedPath("filename", request.filename);
    if (!filename.empty()) requireWritable(filename, kMapFile);  // before the work, not after it
    BuiltMap built = build(request);
    response.map_id = fileInfo(built.bytes.data(), built.bytes.size()).map_id;
    response.report = toMessage(built.report, built.map, response.map_id);
    use(built.bytes);  // it is there, whatever becomes of the file
    response.message = summary(response.report);
    if (!filename.empty()) writeFileAtomically(filename, built.bytes, kMapFile);
    response.success = true;
    ROS_INFO_STREAM("Built " << response.message);
  } catch (const std::exception& error) {
    response.success = false;
    response.message = error.what();
    ROS_ERROR_STREAM("No map built: " << error.what());
  }
  reportStep("fusing", 0.0);
  return true;
}

BuiltMap MapBuilderRos::build(const ttsdf_localization::BuildMap::Request& request) {
  const BuildOptions options = buildOptionsOf(request, options_.build);
  const BuildProgress progress = [this](const std::string& step, double share) {
    reportStep(step, share);
    return !cancelled();
  };
  if (request.source.empty()) return buildFromFused(options, progress);
  return compressed(
      sampleFile(allowedPath("source", request.source), request.scale, options_.fusion, options, progress),
      options, progress);
}

BuiltMap MapBuilderRos::buildFromFused(const BuildOptions& options, const BuildProgress& progress) {
  reportStep("fusing waiting clouds", 0.0);
  if (!fuser_->flush([this] { return cancelled(); })) throw std::runtime_error("cancelled");
  SampledSource source;
  // Only sampling needs the volume: fusion goes on while the field is compressed.
  fuser_->withVolume([&](const TsdfVolume& volume) {
    if (volume.empty()) {
      const auto counts = source_->counts();
      throw std::runtime_error("nothing was fused yet: " + std::to_string(counts.received) +
                               " clouds received on " + source_->topic() + ", " +
                               std::to_string(counts.without_transform) + " without a transform to " +
                               options_.global_frame_id);
    }
    source = sampleVolume(volume, options, progress);
  });
  source.field.agreement = fuser_->agreement();
  return compressed(std::move(source), options, progress);
}

BuiltMap MapBuilderRos::compressed(SampledSource source, const BuildOptions& options,
                                   const BuildProgress& progress) {
  source.field.frame_id = options_.global_frame_id;
  BuiltMap built = compress(source.field, source.fusion, options, progress);
  built.report.frames = source.frames;
  built.report.seconds["distance_field"] = source.seconds;
  return built;
}

bool MapBuilderRos::saveMap(ttsdf_localization::SaveMap::Request& request,
                            ttsdf_localization::SaveMap::Response& response) {
  try {
    if (request.filename.empty() && request.vdb_filename.empty()) {
      throw std::invalid_argument("got neither filename nor vdb_filename, wanted at least one");
    }
    if (!request.filename.empty()) {
      const std::string filename = allowedPath("filename", request.filename);
      const auto held = map_->held();
      if (!held) throw std::runtime_error("no map to save: none was built or loaded yet");
      writeFileAtomically(filename, held->message.data, kMapFile);
      response.map_id = held->message.map_id;
      response.message = "saved map " + held->message.map_id + " to " + request.filename + ". ";
    }
    if (!request.vdb_filename.empty()) {
      const std::string vdb_filename = allowedPath("vdb_filename", request.vdb_filename);
      fuser_->withVolume([&](const TsdfVolume& volume) {
        if (volume.empty()) throw std::runtime_error("no volume to save: nothing was fused yet");
        volume.saveVdb(vdb_filename);
      });
      response.message += "saved the fused volume to " + request.vdb_filename + ".";
    }
    response.success = true;
  } catch (const std::exception& error) {
    response.success = false;
    response.message += error.what();
    ROS_ERROR_STREAM("Not saved: " << error.what());
  }
  return true;
}

bool MapBuilderRos::loadMap(ttsdf_localization::LoadMap::Request& request,
                            ttsdf_localization::LoadMap::Response& response) {
  try {
    use(readFile(allowedPath("filename", request.filename)));
    response.map_id = map_->held()->message.map_id;
    response.message = "loaded map " + response.map_id + " from " + request.filename;
    response.success = true;
  } catch (const std::exception& error) {
    response.success = false;
    response.message = error.what();
    ROS_ERROR_STREAM("Map not loaded, the old one stays: " << error.what());
  }
  return true;
}

bool MapBuilderRos::reset(std_srvs::Trigger::Request& /*request*/, std_srvs::Trigger::Response& response) {
  cancel_ = true;  // a running build holds the volume
  fuser_->reset();
  source_->reset();
  checkpoint_.forget();
  response.success = true;
  response.message = "fused scans and counts are forgotten; the current map stays";
  ROS_INFO_STREAM("Reset: " << response.message);
  publishProgress();
  return true;
}

void MapBuilderRos::use(std::vector<std::uint8_t> bytes) {
  map_->set(std::move(bytes));
  views_->showMap();
}

std::string MapBuilderRos::allowedPath(const std::string& field, const std::string& path) const {
  return pathInFolder(field, path, options_.map_folder);
}

// ---- outputs ----

void MapBuilderRos::reportStep(const std::string& step, double share) {
  bool changed = false;
  {
    const std::lock_guard<std::mutex> lock(progress_mutex_);
    changed = step != step_;
    step_ = step;
    share_ = share;
  }
  if (changed) publishProgress();
}

void MapBuilderRos::publishProgress() {
  const auto input = source_->counts();
  const auto fusion = fuser_->counts();
  const std::lock_guard<std::mutex> lock(progress_mutex_);
  ttsdf_localization::BuildProgress message = last_progress_;
  message.header.frame_id = options_.global_frame_id;
  message.step = step_;
  message.share = static_cast<float>(share_);
  message.received = input.received;
  message.skipped = input.skipped;
  message.without_transform = input.without_transform;
  message.waiting = fusion.waiting;
  message.dropped = fusion.dropped;
  message.refused = fusion.rejected;
  message.fused = fusion.fused;
  if (message == last_progress_) return;
  message.header.stamp = ros::Time::now();
  progress_.publish(message);
  last_progress_ = message;
}

void MapBuilderRos::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) {
  using Level = diagnostic_msgs::DiagnosticStatus;
  const auto input = source_->counts();
  const auto fusion = fuser_->counts();
  const auto held = map_->held();
  status.summary(Level::OK, "fusing");
  if (input.received == 0) status.mergeSummaryf(Level::WARN, "no cloud on %s yet", source_->topic().c_str());
  if (!input.last_transform_error.empty()) status.mergeSummary(Level::WARN, input.last_transform_error);
  if (fusion.dropped > 0)
    status.mergeSummaryf(Level::WARN, "%u clouds dropped: fusion is slower than they come", fusion.dropped);
  const std::string problem = checkpoint_.problem();
  if (!problem.empty()) status.mergeSummary(Level::ERROR, "no checkpoint: " + problem);
  if (fusion.rejected > 0) status.mergeSummary(Level::WARN, "last refused cloud: " + fusion.last_error);
  status.add("clouds received", input.received);
  status.add("clouds not selected", input.skipped);
  status.add("clouds without transform", input.without_transform);
  status.add("clouds waiting", fusion.waiting);
  status.add("clouds dropped", fusion.dropped);
  status.add("clouds refused", fusion.rejected);
  status.add("clouds fused", fusion.fused);
  status.addf("volume memory [MB]", "%.1f", 1e-6 * static_cast<double>(fusion.volume_bytes));
  status.add("map id", held ? held->message.map_id : "none");
}

ros::Publisher publishBuilderStartError(ros::NodeHandle private_nh, const std::string& message) {
  ros::Publisher publisher = private_nh.advertise<ttsdf_localization::BuildProgress>("progress", 1, true);
  ttsdf_localization::BuildProgress progress;
  progress.header.stamp = ros::Time::now();
  progress.step = "not started: " + message;
  publisher.publish(progress);
  return publisher;
}

}  // namespace ttsdf

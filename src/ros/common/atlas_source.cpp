#include "ros/common/atlas_source.h"

#include <algorithm>
#include <sstream>
#include <utility>

namespace ttsdf {

namespace {

constexpr double kBringing = 30.0;  // [s] for the maps around a place that was found
constexpr std::size_t kNamed = 8;   // twins and broken maps in a message

AtlasLocatorOptions locatorOptions(const MapSourceOptions& options, const LocalizerOptions& localizer) {
  AtlasLocatorOptions locator;
  locator.memory_megabytes = options.atlas_megabytes;
  locator.map_megabytes = std::max(0.1, options.memory_megabytes);
  locator.limits = {options.max_map_megabytes, options.max_map_voxels};
  locator.search.registration = localizer.registration;
  locator.search.global = localizer.global;
  locator.search.min_margin = localizer.global.min_margin;
  locator.search.max_score = std::min(locator.search.max_score, localizer.global.max_score);
  return locator;
}

}  // namespace

AtlasSource::AtlasSource(const MapSourceOptions& options, const LocalizerOptions& localizer,
                         MapSource::LoadedCallback loaded, MapSource::FailedCallback failed)
    : registration_(localizer.registration),
      down_is_minus_z_(localizer.mapDown().normalized().z() < -0.999),
      loaded_(std::move(loaded)),
      failed_(std::move(failed)) {
  Atlas atlas = readAtlas(options.atlas_folder);
  frame_id_ = atlas.frame_id;
  if (!atlas.maps.empty()) any_place_ = atlas.maps.front().box().centre();
  locator_ = std::make_unique<AtlasLocator>(options.atlas_folder, atlas, locatorOptions(options, localizer));
  AtlasLoaderOptions loader;
  loader.memory_megabytes = options.atlas_megabytes;
  loader.map_megabytes = std::max(0.1, options.memory_megabytes);
  loader.radius = options.atlas_radius;
  loader.long_range = registration_.long_range && registration_.method == "robust";
  loader.limits = {options.max_map_megabytes, options.max_map_voxels};
  loader_ = std::make_unique<AtlasLoader>(
      options.atlas_folder, std::move(atlas), loader,
      [this](const std::shared_ptr<const AtlasField>& field) { onField(field); });
}

void AtlasSource::wantAny() {
  if (any_place_) loader_->want(*any_place_);
  any_place_.reset();
}

RegistrationResult AtlasSource::find(const ScanPoints& points, const std::optional<Eigen::Vector3d>& gravity,
                                     const ProgressCallback& progress) {
  const auto down = down_is_minus_z_ ? gravity : std::nullopt;
  const AtlasLocation location = locator_->locate(points, down, progress);
  setRemark(location);
  locator_->releaseMaps();
  RegistrationResult result;
  if (!location.candidates.empty()) result = location.candidates.front().result;
  if (location.candidates.size() > 1) {
    result.runner_up_score = location.candidates[1].score();
    result.T_map_runner_up = location.candidates[1].T_atlas_sensor;
  }
  result.reason = location.reason;
  result.success = location.success;
  return result;
}

bool AtlasSource::bring(const Eigen::Vector3d& place, const ProgressCallback& progress) {
  constexpr double kLook = 0.1;  // [s] between two looks at whether it is cancelled
  loader_->want(place);
  for (double waited = 0.0; waited < kBringing; waited += kLook) {
    if (loader_->waitUntilSettled(kLook)) return true;
    if (progress && !progress(1.0)) return false;
  }
  return false;
}

void AtlasSource::setRemark(const AtlasLocation& location) {
  std::ostringstream text;
  if (location.reason == TerminationReason::kAmbiguous) {
    text.precision(2);
    text << "alike:" << std::fixed;
    for (std::size_t n = 0; n < std::min(kNamed, location.candidates.size()); ++n) {
      const AtlasCandidate& candidate = location.candidates[n];
      text << (n == 0 ? " " : ", ") << candidate.map << " ("
           << candidate.T_atlas_sensor.translation().transpose() << ')';
    }
  }
  std::size_t named = 0;
  for (const auto& [map, why] : locator_->failed()) {
    if (named++ == kNamed) break;
    text << (text.tellp() > 0 ? "; " : "") << (map.empty() ? "" : "map '" + map + "': ") << why;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  remark_ = text.str();
}

std::string AtlasSource::remark() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return remark_;
}

void AtlasSource::want(const Eigen::Vector3d& position) {
  constexpr double kLongest = 2.0, kShortest = 0.05;  // [s] between two places that tell a velocity
  constexpr double kFastest = 20.0;                   // [m/s] faster is a jump
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const ros::WallTime now = ros::WallTime::now();
    const double seconds = (now - last_time_).toSec();
    if (last_place_ && seconds < kShortest) return;
    if (last_place_ && seconds <= kLongest) velocity = (position - *last_place_) / seconds;
    if (velocity.norm() > kFastest) velocity.setZero();
    last_place_ = position;
    last_time_ = now;
  }
  loader_->want(position, velocity);
}

void AtlasSource::onField(const std::shared_ptr<const AtlasField>& field) {
  try {
    if (!field) {
      if (!status().waiting.empty()) return;  // they are on their way
      failed_("no map of the atlas is near; the last ones stay in use");
      return;
    }
    LoadedMap loaded;
    loaded.of_atlas = true;
    loaded.map = Localizer::prepareWith(field, field->farField(), registration_);
    loaded.frame_id = frame_id_;
    std::ostringstream text;
    text << "atlas:";
    for (const PlacedField& map : field->maps()) {
      text << ' ' << map.name;
      loaded.map_id += (loaded.map_id.empty() ? "" : "+") + map.map_id;
    }
    text << "; " << field->memoryBytes() << " bytes in memory";
    loaded.summary = text.str();
    loaded_(std::move(loaded));
  } catch (const std::exception& error) {
    failed_(error.what());
  }
}

}  // namespace ttsdf

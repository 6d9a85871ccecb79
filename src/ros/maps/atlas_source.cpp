#include "ros/maps/atlas_source.h"

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <utility>

#include "ttsdf_localization/atlas/place_index_file.h"

namespace ttsdf {

namespace {

constexpr double kBringing = 30.0;    // [s] for the maps around a place that was found
constexpr double kLookPeriod = 1.0;   // [s] between two looks at the folder
constexpr double kServerRetry = 5.0;  // [s] a map that the server did not give is asked for again
constexpr std::size_t kNamed = 8;     // twins and broken maps in a message

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

AtlasSource::AtlasSource(ros::NodeHandle& node, const MapSourceOptions& options,
                         const LocalizerOptions& localizer, MapSource::LoadedCallback loaded,
                         MapSource::FailedCallback failed)
    : options_(options), localizer_(localizer), loaded_(std::move(loaded)), failed_(std::move(failed)) {
  if (options.map_source == "atlas") {
    const std::string seen = stateOfAtlas(options.atlas_folder);  // before it is read
    useFolder();
    watch_ = std::make_unique<FolderWatch>(
        options.atlas_folder, seen, kLookPeriod, [this] { useFolder(); },
        [this](const std::string& why) {
          failed_("the atlas has changed and cannot be read, the one before stays: " + why);
        });
    return;
  }
  client_ = std::make_unique<AtlasClient>(
      node, options.atlas_timeout,
      [this](Atlas atlas, const std::vector<std::uint8_t>& places) {
        useAtlas(
            std::move(atlas), [this](const AtlasMap& map) { return client_->fetch(map); }, places);
      },
      failed_);
}

void AtlasSource::useFolder() {
  Atlas atlas = readAtlas(options_.atlas_folder);
  std::vector<std::uint8_t> places;
  const std::string index = options_.atlas_folder + "/" + kPlaceIndexFile;
  if (std::filesystem::exists(index)) places = readFile(index);
  useAtlas(std::move(atlas), mapFilesIn(options_.atlas_folder), places);
}

void AtlasSource::stop() {
  watch_.reset();
  if (client_) client_->stop();
}

AtlasSource::~AtlasSource() {
  stop();  // the loader may be waiting for an answer
  std::shared_ptr<AtlasLoader> loader;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    loader = std::move(loader_);
  }
}

void AtlasSource::useAtlas(Atlas atlas, const MapBytes& files, const std::vector<std::uint8_t>& places) {
  auto locator = std::make_shared<AtlasLocator>(files, atlas, places, locatorOptions(options_, localizer_));
  AtlasLoaderOptions options;
  options.memory_megabytes = options_.atlas_megabytes;
  options.map_megabytes = std::max(0.1, options_.memory_megabytes);
  options.radius = options_.atlas_radius;
  options.long_range = localizer_.registration.long_range && localizer_.registration.method == "robust";
  options.limits = {options_.max_map_megabytes, options_.max_map_voxels};
  if (client_) options.retry_seconds = kServerRetry;
  const std::lock_guard<std::mutex> lock(mutex_);
  locator_ = std::move(locator);
  if (!atlas.maps.empty() && !last_place_) any_place_ = atlas.maps.front().box().centre();
  if (loader_) {
    loader_->setAtlas(std::move(atlas));
    return;
  }
  const std::string frame_id = atlas.frame_id;
  loader_ = std::make_shared<AtlasLoader>(
      files, std::move(atlas), options,
      [this, frame_id](const std::shared_ptr<const AtlasField>& field) { onField(frame_id, field); });
  if (last_place_) loader_->want(*last_place_, Eigen::Vector3d::Zero());
}

std::shared_ptr<AtlasLoader> AtlasSource::loader() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return loader_;
}

AtlasLoaderStatus AtlasSource::status() const {
  const auto loader = this->loader();
  return loader ? loader->status() : AtlasLoaderStatus();
}

void AtlasSource::wantAny() {
  std::optional<Eigen::Vector3d> place;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!loader_) return;
    place.swap(any_place_);
  }
  if (place) loader()->want(*place);
}

std::shared_ptr<AtlasLocator> AtlasSource::locator() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return locator_;
}

RegistrationResult AtlasSource::find(const LocalizerScan& scan, const std::optional<Eigen::Vector3d>& gravity,
                                     bool goes_on, const ProgressCallback& progress) {
  const auto locator = this->locator();
  RegistrationResult result;
  may_go_on_ = false;
  if (!locator) return result;
  // The search takes down as -z of the atlas.
  const bool level = localizer_.mapDown().normalized().z() < -0.999;
  const std::optional<Eigen::Vector3d> down = level ? gravity : std::nullopt;
  const bool moving = down && scan.T_odom_base;
  const auto add = [&] {
    return locator->locateMoving(scan.points, *down, *scan.T_odom_base * scan.T_base_sensor, progress);
  };
  AtlasLocation location;
  if (goes_on && moving) {
    location = add();
  } else {
    locator->forgetScans();
    location = locator->locate(scan.points, down, progress);
    // The first of a drive, if one comes; what it says by itself is said already.
    if (moving && !location.success && location.reason != TerminationReason::kCancelled) add();
  }
  may_go_on_ = moving && !location.success && location.reason != TerminationReason::kCancelled;
  setRemark(location, *locator);
  if (!may_go_on_) locator->releaseMaps();
  if (!location.candidates.empty()) result = location.candidates.front().result;
  if (location.candidates.size() > 1) {
    result.runner_up_score = location.candidates[1].score();
    result.T_map_runner_up = location.candidates[1].T_atlas_sensor;
  }
  result.reason = location.reason;
  result.success = location.success;
  return result;
}

void AtlasSource::forgetScans() {
  const auto locator = this->locator();
  if (!locator) return;
  locator->forgetScans();
  locator->releaseMaps();
}

bool AtlasSource::loadAround(const Eigen::Vector3d& place, const ProgressCallback& progress) {
  constexpr double kLook = 0.1;  // [s] between two looks at whether it is cancelled
  const auto loader = this->loader();
  if (!loader) return false;
  loader->want(place);
  for (double waited = 0.0; waited < kBringing; waited += kLook) {
    if (loader->waitUntilSettled(kLook)) return true;
    if (progress && !progress(1.0)) return false;
  }
  return false;
}

void AtlasSource::setRemark(const AtlasLocation& location, const AtlasLocator& locator) {
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
  for (const auto& [map, why] : locator.failed()) {
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
  if (const auto loader = this->loader()) loader->want(position, velocity);
}

void AtlasSource::onField(const std::string& frame_id, const std::shared_ptr<const AtlasField>& field) {
  try {
    if (!field) {
      if (!status().waiting.empty()) return;  // they are on their way
      failed_("no map of the atlas is near; the last ones stay in use");
      return;
    }
    LoadedMap loaded;
    loaded.of_atlas = true;
    loaded.map = Localizer::prepareWith(field, field->farField(), localizer_.registration);
    loaded.frame_id = frame_id;
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

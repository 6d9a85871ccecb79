#include "ttsdf_localization/atlas/atlas_locator.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "map_shelf.h"
#include "ttsdf_localization/atlas/place_index_file.h"

namespace ttsdf {

namespace {

constexpr double kIndexShare = 0.5;  // of the progress, where the index has to be made

void check(const AtlasLocatorOptions& options) {
  for (const auto& [name, value] : {std::pair("memory_megabytes", options.memory_megabytes),
                                    std::pair("map_megabytes", options.map_megabytes)}) {
    if (std::isfinite(value) && value > 0.0) continue;
    throw std::invalid_argument(std::string("atlas locator: ") + name + ": got " + std::to_string(value) +
                                ", wanted a number above 0");
  }
}

/// A search holds its maps and about as many around them.
int mapsAtOnce(const AtlasLocatorOptions& options) {
  const int fitting = static_cast<int>(options.memory_megabytes / options.map_megabytes / 2.0);
  return std::clamp(fitting, 1, std::max(1, options.search.maps_at_once));
}

}  // namespace

class AtlasLocator::Impl {
 public:
  Impl(MapBytes files, Atlas atlas, const AtlasLocatorOptions& options)
      : files_(std::move(files)),
        atlas_((check(atlas), std::move(atlas))),
        options_((check(options), options)),
        neighbours_(atlas_.neighbours()),
        keys_(placeKeys(atlas_)),
        moving_(options.moving) {
    options_.search.maps_at_once = mapsAtOnce(options);
    for (std::size_t n = 0; n < atlas_.maps.size(); ++n) places_[atlas_.maps[n].name] = n;
  }

  void useIndex(const std::function<PlaceIndex()>& read) {
    try {
      index_ = read();
    } catch (const std::exception& error) {
      failed_[""] = error.what();  // it is made again
    }
  }

  bool completeIndex(const ProgressCallback& progress) {
    std::vector<std::size_t> missing;
    for (std::size_t n = 0; n < atlas_.maps.size(); ++n) {
      if (!index_.find(atlas_.maps[n].name)) missing.push_back(n);
    }
    for (std::size_t k = 0; k < missing.size(); ++k) {
      if (progress && !progress(static_cast<double>(k) / static_cast<double>(missing.size()))) return false;
      const std::string& name = atlas_.maps[missing[k]].name;
      const std::vector<PlacedField> around = mapsAround(name);
      if (around.empty()) continue;
      try {
        index_.add(around, keys_[missing[k]]);
      } catch (const std::exception& error) {
        failed_[name] = error.what();
      }
    }
    return true;
  }

  AtlasLocation locate(const ScanPoints& points, const std::optional<Eigen::Vector3d>& down,
                       const ProgressCallback& progress) {
    const bool whole = index_.maps().size() == atlas_.maps.size();
    const double begins = whole ? 0.0 : kIndexShare;
    const auto share = [&](double from, double to) {
      return [&progress, from, to](double done) { return !progress || progress(from + (to - from) * done); };
    };
    if (!completeIndex(share(0.0, begins))) {
      AtlasLocation cancelled;
      cancelled.reason = TerminationReason::kCancelled;
      return cancelled;
    }
    std::vector<std::string> unknown;
    for (const AtlasMap& map : atlas_.maps) {
      if (!index_.find(map.name)) unknown.push_back(map.name);
    }
    return locateInAtlas(
        index_, [this](const std::string& name) { return mapsAround(name); }, points, down, options_.search,
        share(begins, 1.0), unknown);
  }

  AtlasLocation locateMoving(const ScanPoints& points, const Eigen::Vector3d& down,
                             const Eigen::Isometry3d& T_odom_sensor, const ProgressCallback& progress) {
    AtlasLocation location;
    location.reason = TerminationReason::kCancelled;
    const double begins = index_.maps().size() == atlas_.maps.size() ? 0.0 : kIndexShare;
    if (!completeIndex([&](double done) { return !progress || progress(begins * done); })) return location;
    location = moving_.add(
        {atlas_, index_, [this](const std::string& name) { return mapsAround(name); }}, points, down,
        T_odom_sensor, [&](double done) { return !progress || progress(begins + (1.0 - begins) * done); });
    if (location.success && index_.maps().size() < atlas_.maps.size()) {
      location.success = false;  // the scan may have been taken in a map without places
      location.reason = TerminationReason::kUnsure;
    }
    return location;
  }
  void forgetScans() { moving_.clear(); }
  int movingScans() const { return moving_.scans(); }

  const PlaceIndex& index() const { return index_; }
  const std::map<std::string, std::string>& failed() const { return failed_; }
  void releaseMaps() { shelf_ = MapShelf(); }

 private:
  /// A map and its neighbours; empty if it cannot be read itself.
  std::vector<PlacedField> mapsAround(const std::string& name) {
    const std::size_t n = places_.at(name);
    std::set<std::string> keep{name};
    for (const std::size_t m : neighbours_[n]) keep.insert(atlas_.maps[m].name);
    std::vector<PlacedField> around;
    if (!take(atlas_.maps[n], keep, around)) return {};
    for (const std::size_t m : neighbours_[n]) take(atlas_.maps[m], keep, around);
    return around;
  }

  bool take(const AtlasMap& map, const std::set<std::string>& keep, std::vector<PlacedField>& around) {
    if (!shelf_.has(map.name)) {
      const auto bytes = [](double megabytes) { return static_cast<std::size_t>(megabytes * 1048576.0); };
      shelf_.makeRoom(shelf_.expected(map, bytes(options_.map_megabytes)), bytes(options_.memory_megabytes),
                      keep);
      try {
        PlacedField placed = loadPlaced(files_, map, options_.map_megabytes, true, options_.limits, {});
        if (!placed.far) throw std::runtime_error("map '" + map.name + "' shows no surface");
        shelf_.put(std::move(placed));
        failed_.erase(map.name);
      } catch (const std::exception& error) {
        failed_[map.name] = error.what();
        return false;
      }
    }
    shelf_.touch(map.name);
    around.push_back(shelf_.get(map.name));
    return true;
  }

  const MapBytes files_;
  const Atlas atlas_;
  AtlasLocatorOptions options_;
  const std::vector<std::vector<std::size_t>> neighbours_;
  const std::vector<std::uint32_t> keys_;
  std::map<std::string, std::size_t> places_;  ///< in the atlas
  PlaceIndex index_;
  MovingSearch moving_;
  MapShelf shelf_;
  std::map<std::string, std::string> failed_;
};

AtlasLocator::AtlasLocator(const std::string& folder, Atlas atlas, const AtlasLocatorOptions& options)
    : impl_(std::make_unique<Impl>(mapFilesIn(folder), atlas, options)) {
  impl_->useIndex([&] { return readPlaceIndex(folder, atlas); });
}
AtlasLocator::AtlasLocator(MapBytes files, Atlas atlas, const std::vector<std::uint8_t>& places,
                           const AtlasLocatorOptions& options)
    : impl_(std::make_unique<Impl>(std::move(files), atlas, options)) {
  if (!places.empty()) impl_->useIndex([&] { return fittingPlaces(deserializePlaces(places), atlas); });
}
AtlasLocator::~AtlasLocator() = default;
bool AtlasLocator::completeIndex(const ProgressCallback& progress) { return impl_->completeIndex(progress); }
const PlaceIndex& AtlasLocator::index() const { return impl_->index(); }
AtlasLocation AtlasLocator::locate(const ScanPoints& points,
                                   const std::optional<Eigen::Vector3d>& down_sensor,
                                   const ProgressCallback& progress) {
  return impl_->locate(points, down_sensor, progress);
}
AtlasLocation AtlasLocator::locateMoving(const ScanPoints& points, const Eigen::Vector3d& down_sensor,
                                         const Eigen::Isometry3d& T_odom_sensor,
                                         const ProgressCallback& progress) {
  return impl_->locateMoving(points, down_sensor, T_odom_sensor, progress);
}
void AtlasLocator::forgetScans() { impl_->forgetScans(); }
int AtlasLocator::movingScans() const { return impl_->movingScans(); }
const std::map<std::string, std::string>& AtlasLocator::failed() const { return impl_->failed(); }
void AtlasLocator::releaseMaps() { impl_->releaseMaps(); }

}  // namespace ttsdf

#include "ros/common/atlas_source.h"

#include <algorithm>
#include <sstream>
#include <utility>

namespace ttsdf {

AtlasSource::AtlasSource(const MapSourceOptions& options, const RegistrationOptions& registration,
                         MapSource::LoadedCallback loaded, MapSource::FailedCallback failed)
    : registration_(registration), loaded_(std::move(loaded)), failed_(std::move(failed)) {
  Atlas atlas = readAtlas(options.atlas_folder);
  frame_id_ = atlas.frame_id;
  AtlasLoaderOptions loader;
  loader.memory_megabytes = options.atlas_megabytes;
  loader.map_megabytes = std::max(0.1, options.memory_megabytes);
  loader.radius = options.atlas_radius;
  loader.long_range = registration.long_range && registration.method == "robust";
  loader.limits = {options.max_map_megabytes, options.max_map_voxels};
  loader_ = std::make_unique<AtlasLoader>(
      options.atlas_folder, std::move(atlas), loader,
      [this](const std::shared_ptr<const AtlasField>& field) { onField(field); });
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

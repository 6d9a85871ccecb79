#pragma once
// The maps around the robot, out of a folder with an atlas.yaml, as one map that is exchanged between two
// scans.

#include <ros/time.h>

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "ros/common/map_source.h"
#include "ttsdf_localization/atlas/atlas_loader.h"

namespace ttsdf {

class AtlasSource {
 public:
  /// `loaded` runs in the loader's thread. Throws std::runtime_error naming the folder.
  AtlasSource(const MapSourceOptions& options, const RegistrationOptions& registration,
              MapSource::LoadedCallback loaded, MapSource::FailedCallback failed);

  /// Where the robot is, several times a second; the velocity follows from that. Returns at once.
  void want(const Eigen::Vector3d& position);
  AtlasLoaderStatus status() const { return loader_->status(); }

 private:
  void onField(const std::shared_ptr<const AtlasField>& field);

  const RegistrationOptions registration_;
  const MapSource::LoadedCallback loaded_;
  const MapSource::FailedCallback failed_;
  std::string frame_id_;
  std::mutex mutex_;  ///< of the place before
  std::optional<Eigen::Vector3d> last_place_;
  ros::WallTime last_time_;
  std::unique_ptr<AtlasLoader> loader_;  ///< last: its thread ends first
};

}  // namespace ttsdf

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
#include "ttsdf_localization/atlas/atlas_locator.h"

namespace ttsdf {

class AtlasSource {
 public:
  /// `loaded` runs in the loader's thread. Throws std::runtime_error naming the folder.
  AtlasSource(const MapSourceOptions& options, const LocalizerOptions& localizer,
              MapSource::LoadedCallback loaded, MapSource::FailedCallback failed);

  /// Where the robot is, several times a second; the velocity follows from that. Returns at once.
  void want(const Eigen::Vector3d& position);
  /// Nobody knows where the robot is: the first map of the atlas, so that there is one to begin with.
  void wantAny();

  // Global localization over the whole atlas; one search at a time, in a thread that may take long.
  /// The place of a scan, in the atlas' frame.
  RegistrationResult find(const ScanPoints& points, const std::optional<Eigen::Vector3d>& gravity,
                          const ProgressCallback& progress);
  /// Waits until the maps around a place are in use.
  bool bring(const Eigen::Vector3d& place, const ProgressCallback& progress);
  /// What the last find() has to say beside its result: twins, maps that cannot be read.
  std::string remark() const;

  AtlasLoaderStatus status() const { return loader_->status(); }

 private:
  void onField(const std::shared_ptr<const AtlasField>& field);

  void setRemark(const AtlasLocation& location);

  const RegistrationOptions registration_;
  const bool down_is_minus_z_;  ///< as the search of an atlas takes it
  const MapSource::LoadedCallback loaded_;
  const MapSource::FailedCallback failed_;
  std::string frame_id_;
  std::optional<Eigen::Vector3d> any_place_;  ///< in the first map
  std::unique_ptr<AtlasLocator> locator_;
  mutable std::mutex mutex_;  ///< of the place before and the remark
  std::string remark_;
  std::optional<Eigen::Vector3d> last_place_;
  ros::WallTime last_time_;
  std::unique_ptr<AtlasLoader> loader_;  ///< last: its thread ends first
};

}  // namespace ttsdf

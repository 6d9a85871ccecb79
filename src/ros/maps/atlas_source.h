#pragma once
// The maps around the robot, out of a folder with an atlas.yaml or from a server, as one map that is
// exchanged between two scans.

#include <ros/time.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "ros/maps/atlas_client.h"
#include "ros/maps/folder_watch.h"
#include "ros/maps/map_source.h"
#include "ttsdf_localization/atlas/atlas_loader.h"
#include "ttsdf_localization/atlas/atlas_locator.h"

namespace ttsdf {

class AtlasSource {
 public:
  /// As map_source says: from atlas_folder, or from whoever publishes `atlas`. `loaded` runs in the loader's
  /// thread. Throws std::runtime_error naming the folder.
  AtlasSource(ros::NodeHandle& node, const MapSourceOptions& options, const LocalizerOptions& localizer,
              MapSource::LoadedCallback loaded, MapSource::FailedCallback failed);
  ~AtlasSource();
  /// Ends calls to a server that run, and makes no more: nobody waits for one that hangs.
  void stop();

  /// Where the robot is, several times a second; the velocity follows from that. Returns at once.
  void want(const Eigen::Vector3d& position);
  /// Nobody knows where the robot is: the first map of the atlas, so that there is one to begin with.
  void wantAny();

  // Global localization over the whole atlas; one search at a time, in a thread that may take long.
  /// The place of a scan, in the atlas' frame. `goes_on`: with the scans that did not decide it before, since
  /// forgetScans(); needs odometry and gravity, and keeps the maps that it needs.
  RegistrationResult find(const LocalizerScan& scan, const std::optional<Eigen::Vector3d>& gravity,
                          bool goes_on, const ProgressCallback& progress);
  /// The last find() has not decided, and scans that follow it may.
  bool mayGoOn() const { return may_go_on_; }
  /// Never while find() runs.
  void forgetScans();
  /// Waits until the maps around a place are in use.
  bool loadAround(const Eigen::Vector3d& place, const ProgressCallback& progress);
  /// What the last find() has to say beside its result: twins, maps that cannot be read.
  std::string remark() const;

  /// Empty until there is an atlas.
  AtlasLoaderStatus status() const;

 private:
  /// What the folder holds now.
  void useFolder();
  /// An atlas, or another edition of it.
  void useAtlas(Atlas atlas, const MapBytes& files, const std::vector<std::uint8_t>& places);
  void onField(const std::string& frame_id, const std::shared_ptr<const AtlasField>& field);
  std::shared_ptr<AtlasLoader> loader() const;
  std::shared_ptr<AtlasLocator> locator() const;
  void setRemark(const AtlasLocation& location, const AtlasLocator& locator);

  const MapSourceOptions options_;
  const LocalizerOptions localizer_;
  const MapSource::LoadedCallback loaded_;
  const MapSource::FailedCallback failed_;

  std::atomic<bool> may_go_on_{false};
  mutable std::mutex mutex_;                  ///< guards everything down to the client
  std::optional<Eigen::Vector3d> any_place_;  ///< in the first map
  std::optional<Eigen::Vector3d> last_place_;
  ros::WallTime last_time_;
  std::string remark_;
  std::shared_ptr<AtlasLocator> locator_;
  std::shared_ptr<AtlasLoader> loader_;

  std::unique_ptr<AtlasClient> client_;
  std::unique_ptr<FolderWatch> watch_;  ///< of a local folder
};

}  // namespace ttsdf

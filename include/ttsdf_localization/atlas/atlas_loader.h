#pragma once
// The maps near the robot, loaded and dropped in a thread of its own: scans never wait for a file.
//
// A map is wanted while its box is near the pose, or near where the robot will be soon. Of the wanted ones
// the nearest come first, as many as the budget holds; what is loaded and no longer wanted stays as long as
// there is room, and the least recently wanted goes first. A map that is dropped lives on in the fields that
// were handed out, until their users take the next one.

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/atlas/atlas_field.h"

namespace ttsdf {

struct AtlasLoaderOptions {
  double memory_megabytes = 60.0;  ///< of all maps, far fields included
  double map_megabytes = 4.0;      ///< of one (TtFieldOptions::memory_megabytes)
  double radius = 6.0;      ///< maps at most this far from the pose are wanted: as far as the sensor sees [m]
  double prediction = 3.0;  ///< the robot is expected to keep its velocity for so long [s]
  double retry_seconds = 30.0;  ///< a map that could not be read is tried again after [s]
  bool long_range = true;       ///< make far fields
  MapLimits limits;             ///< of one map file
};
/// Throws std::invalid_argument for what is not positive.
void check(const AtlasLoaderOptions& options);

struct AtlasLoaderStatus {
  std::vector<std::string> in_use;            ///< of the newest field
  std::vector<std::string> waiting;           ///< wanted, within the budget, not loaded yet
  std::size_t over_budget = 0;                ///< wanted maps for which there is no memory
  std::map<std::string, std::string> failed;  ///< map -> why it cannot be used
  std::size_t loaded = 0, bytes = 0;          ///< in memory, used or kept
  bool behind = false;  ///< the pose is in a map that is waiting, and in none that is in use
};

class AtlasLoader {
 public:
  /// Called in the loader's thread with every new field; null: no map is in use.
  using Changed = std::function<void(const std::shared_ptr<const AtlasField>&)>;

  /// Throws std::invalid_argument for options or an atlas that cannot be used. Loads nothing before the first
  /// want().
  AtlasLoader(MapBytes files, Atlas atlas, const AtlasLoaderOptions& options, Changed changed = {});
  AtlasLoader(const std::string& folder, Atlas atlas, const AtlasLoaderOptions& options,
              Changed changed = {});
  /// Cancels what is being loaded.
  ~AtlasLoader();
  AtlasLoader(const AtlasLoader&) = delete;
  AtlasLoader& operator=(const AtlasLoader&) = delete;

  /// Where the robot is and how it moves [m/s], in the atlas' frame. Returns at once.
  void want(const Eigen::Vector3d& position, const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero());
  /// Another edition of the atlas: maps with a new id are loaded again and used as before until then; maps
  /// that failed are tried again. Throws std::invalid_argument for an atlas that cannot be used.
  void setAtlas(Atlas atlas);

  /// The newest field; null: no map is in use.
  std::shared_ptr<const AtlasField> field() const;
  AtlasLoaderStatus status() const;
  /// Waits until nothing is left to load for the last want(). False: not within the time.
  bool waitUntilSettled(double seconds) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ttsdf

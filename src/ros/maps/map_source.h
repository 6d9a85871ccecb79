#pragma once
// Maps from a file, a topic or a service, made ready in a thread of its own: scans go on with the old map
// meanwhile.

#include <ros/node_handle.h>
#include <ros/service_server_link.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "ros/parameters/localization_options.h"
#include "ros/scans/newest_slot.h"
#include "ttsdf_localization/GetMap.h"
#include "ttsdf_localization/SetMap.h"
#include "ttsdf_localization/TtSdfMap.h"
#include "ttsdf_localization/localization/localizer.h"

namespace ttsdf {

/// A map that was checked and can be put into use at once.
struct LoadedMap {
  PreparedMap map;
  bool of_atlas = false;  ///< exchanged for the one before: pose and state stay
  std::string map_id;
  std::string frame_id;                  ///< the map's own name for its frame
  std::string summary;                   ///< dims, ranks, voxel size, bytes in file and in memory
  ttsdf_localization::TtSdfMap message;  ///< with the bytes of the map file
};

/// Decodes, checks and prepares. Throws MapFormatError.
LoadedMap prepareMap(const std::vector<std::uint8_t>& bytes, const MapSourceOptions& options,
                     const RegistrationOptions& registration);
/// The same from a file. Throws std::runtime_error naming it.
LoadedMap prepareMapFile(const std::string& path, const MapSourceOptions& options,
                         const RegistrationOptions& registration);

class MapSource {
 public:
  using LoadedCallback = std::function<void(LoadedMap)>;
  using FailedCallback = std::function<void(const std::string& message)>;

  /// Starts loading by itself as the options say. Callbacks run in the loading thread.
  MapSource(ros::NodeHandle& node, const MapSourceOptions& options, const RegistrationOptions& registration,
            LoadedCallback loaded, FailedCallback failed);
  ~MapSource();

  /// In the caller's thread.
  LoadedMap prepare(const std::vector<std::uint8_t>& bytes) const {
    return prepareMap(bytes, options_, registration_);
  }
  LoadedMap prepareFile(const std::string& path) const {
    return prepareMapFile(path, options_, registration_);
  }

 private:
  using Job = std::function<LoadedMap()>;
  void run();
  void onMap(const ttsdf_localization::TtSdfMapConstPtr& message);
  void callService();
  /// Throw std::runtime_error with the reason.
  ttsdf_localization::GetMap::Response callOnce(const std::string& service);
  LoadedMap mapOfService(const std::string& service);
  void put(Job job);

  const MapSourceOptions options_;
  const RegistrationOptions registration_;
  const LoadedCallback loaded_;
  const FailedCallback failed_;
  std::atomic<bool> stop_{false};
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  NewestSlot<Job> jobs_;
  std::mutex mutex_;
  std::string last_topic_id_;       ///< the same map again is not loaded again
  ros::ServiceServerLinkPtr link_;  ///< of the call that runs
  std::thread thread_;
};

}  // namespace ttsdf

#pragma once
// The map that a node offers: latched topic `ttsdf_map` and service `get_map`, as map_server does for amcl.
// Core only.

#include <ros/ros.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "ttsdf_localization/GetMap.h"
#include "ttsdf_localization/TtSdfMap.h"
#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

/// Thread-safe.
class MapPublisher {
 public:
  struct Held {
    std::shared_ptr<const TtSdfMap> map;
    ttsdf_localization::TtSdfMap message;  ///< with the bytes of the map file
  };

  /// Advertises in `nh`; the service runs in nh's callback queue.
  explicit MapPublisher(ros::NodeHandle nh);

  /// Checks the bytes of a map file as a reader would, then publishes them. Throws MapFormatError, and the
  /// old map stays. Returns the map's id.
  std::string set(std::vector<std::uint8_t> bytes);
  /// Null before the first map.
  std::shared_ptr<const Held> held() const;

 private:
  bool getMap(ttsdf_localization::GetMap::Request& request, ttsdf_localization::GetMap::Response& response);

  mutable std::mutex mutex_;
  std::shared_ptr<const Held> held_;
  ros::Publisher publisher_;
  ros::ServiceServer service_;
};

}  // namespace ttsdf

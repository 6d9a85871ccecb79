#pragma once
// Offers an atlas to robots: its maps without their bytes as a latched topic, the bytes by services.

#include <ros/ros.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "ttsdf_localization/AtlasInfo.h"
#include "ttsdf_localization/GetDifferentialMap.h"
#include "ttsdf_localization/GetSelectedMaps.h"
#include "ttsdf_localization/atlas/atlas.h"

namespace ttsdf {

class AtlasServerRos {
 public:
  /// Looks every second whether atlas.yaml or the index of places has changed. Throws std::runtime_error
  /// naming the folder.
  AtlasServerRos(ros::NodeHandle nh, const std::string& folder);

 private:
  void load();
  void lookForChanges();
  ttsdf_localization::AtlasMapFile fileOf(const AtlasMap& map) const;
  bool getDifference(ttsdf_localization::GetDifferentialMap::Request& request,
                     ttsdf_localization::GetDifferentialMap::Response& response);
  bool getSelected(ttsdf_localization::GetSelectedMaps::Request& request,
                   ttsdf_localization::GetSelectedMaps::Response& response);

  const std::string folder_;
  ros::Publisher publisher_;
  std::string seen_;  ///< when and how large the files were
  mutable std::mutex mutex_;
  std::shared_ptr<const Atlas> atlas_;
  std::vector<ros::ServiceServer> services_;
  ros::WallTimer timer_;
};

}  // namespace ttsdf

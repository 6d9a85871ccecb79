#pragma once
// Maps of an atlas from a server: what there is by a latched topic, the maps by a service, within a time
// limit.

#include <ros/node_handle.h>
#include <ros/service_server_link.h>

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "ttsdf_localization/AtlasInfo.h"
#include "ttsdf_localization/GetSelectedMaps.h"
#include "ttsdf_localization/atlas/atlas.h"

namespace ttsdf {

class AtlasClient {
 public:
  /// `changed` runs in a thread of the node's queue with every edition of the atlas; `failed`: one that
  /// cannot be used.
  using Changed = std::function<void(Atlas atlas, std::vector<std::uint8_t> places)>;
  using Failed = std::function<void(const std::string& message)>;

  /// `timeout`: of one call [s].
  AtlasClient(ros::NodeHandle& node, double timeout, Changed changed, Failed failed);
  ~AtlasClient() { stop(); }
  AtlasClient(const AtlasClient&) = delete;
  AtlasClient& operator=(const AtlasClient&) = delete;

  /// The bytes of a map. Throws std::runtime_error: no server, no answer in time, a refusal. From one thread
  /// at a time or several.
  std::vector<std::uint8_t> fetch(const AtlasMap& map);
  /// Ends the calls that run; later ones fail at once.
  void stop();

 private:
  void onAtlas(const ttsdf_localization::AtlasInfoConstPtr& message);
  void call(ttsdf_localization::GetSelectedMaps& call);

  const double timeout_;
  const Changed changed_;
  const Failed failed_;
  const std::string service_;
  std::mutex mutex_;
  bool stopped_ = false;
  std::vector<ros::ServiceServerLinkPtr> links_;  ///< of the calls that run
  ros::Subscriber subscriber_;
};

}  // namespace ttsdf

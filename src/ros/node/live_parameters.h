#pragma once
// Parameters that may change while the localizer runs, offered as dynamic_reconfigure does (rqt_reconfigure,
// dynparam). Names, ranges, defaults and descriptions come from the option tables: there is no .cfg file that
// could disagree. A name is the key of the YAML file, "gates/min_inlier_ratio".

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/node_handle.h>

#include <functional>
#include <mutex>
#include <vector>

#include "ros/parameters/localization_options.h"

namespace ttsdf {

/// Name, type, range and default of every parameter with isLive().
dynamic_reconfigure::ConfigDescription liveDescription();
/// The values of `options`.
dynamic_reconfigure::Config liveConfig(const LocalizationRosOptions& options);
/// `options` with the values of `config`, which may leave some out. Throws std::invalid_argument for a name
/// that is not live, a wrong type, a value out of range or a contradiction, as at the start.
LocalizationRosOptions withLiveValues(const LocalizationRosOptions& options,
                                      const dynamic_reconfigure::Config& config);

class LiveParameters {
 public:
  /// Puts changed options into use.
  using Apply = std::function<void(const LocalizationRosOptions&)>;

  LiveParameters(const ros::NodeHandle& private_node, const LocalizationRosOptions& options, Apply apply);
  /// No request after this.
  void shutdown();

 private:
  bool set(dynamic_reconfigure::Reconfigure::Request& request,
           dynamic_reconfigure::Reconfigure::Response& response);
  void remember(const dynamic_reconfigure::Config& config) const;

  ros::NodeHandle private_node_;
  const Apply apply_;
  std::mutex mutex_;
  LocalizationRosOptions options_;  ///< in use
  ros::Publisher descriptions_, updates_;
  ros::ServiceServer service_;
};

}  // namespace ttsdf

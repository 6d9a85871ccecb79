#pragma once
// A menu and a status text in rviz, as an interactive marker: what an operator does every day without typing
// service calls. A click on the ball above the robot opens it.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <interactive_markers/interactive_marker_server.h>
#include <interactive_markers/menu_handler.h>
#include <ros/ros.h>
#include <visualization_msgs/Marker.h>

#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "ros/scans/newest_slot.h"
#include "ttsdf_localization/LocalizationStatus.h"
#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct OperatorMenuOptions {
  std::string localization = "localization";  ///< name of the localization node
  std::string map_builder = "map_builder";    ///< name of the map builder
  std::string map_folder;  ///< maps offered for loading, and where a built map goes; "": neither
  std::string global_frame_id = "map";
  double height = 1.0;     ///< of the ball above the base [m]
  double text_size = 0.2;  ///< [m]
};
const OptionTable<OperatorMenuOptions>& operatorMenuOptionTable();

/// Map files (*.ttsdf) of a folder, sorted; none if it cannot be read.
std::vector<std::string> mapFiles(const std::string& folder);
/// Two or three lines for the view: state, fit, why not.
std::string statusText(const ttsdf_localization::LocalizationStatus& status, const std::string& last_reply);

class OperatorMenu {
 public:
  /// Reads the private parameters. Throws std::invalid_argument for bad ones.
  OperatorMenu(const ros::NodeHandle& node, const ros::NodeHandle& private_node);
  ~OperatorMenu();
  OperatorMenu(const OperatorMenu&) = delete;
  OperatorMenu& operator=(const OperatorMenu&) = delete;

 private:
  using Status = ttsdf_localization::LocalizationStatus;
  /// A service call; returns the line to show.
  using Action = std::function<std::string()>;

  void insertBall(const std::string& frame);
  void fillMenu();
  void addEntry(const std::string& title, Action action);
  void addMaps();
  template <class Service>
  Action call(const std::string& service, const Service& request);
  void run();
  void draw();
  void onStatus(const Status& status);
  void onPose(const geometry_msgs::PoseWithCovarianceStamped& pose);

  OperatorMenuOptions options_;
  ros::NodeHandle node_;
  interactive_markers::InteractiveMarkerServer server_;
  interactive_markers::MenuHandler menu_;

  std::mutex mutex_;
  Status status_;
  std::string frame_;  ///< of the map
  geometry_msgs::Point position_;
  std::string reply_;  ///< of the last action
  bool menu_stale_ = true;

  NewestSlot<Action> actions_;
  ros::Publisher text_;
  ros::Subscriber status_subscriber_, pose_subscriber_;
  ros::WallTimer draw_timer_;
  std::thread worker_;
};

}  // namespace ttsdf

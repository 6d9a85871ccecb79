#include "ros/operator/operator_menu.h"

#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <utility>

#include "ros/parameters/parameters.h"
#include "ttsdf_localization/BuildMap.h"
#include "ttsdf_localization/GlobalLocalization.h"
#include "ttsdf_localization/LoadMap.h"
#include "ttsdf_localization/Relocalize.h"

namespace ttsdf {

namespace {

constexpr const char* kMarker = "operator";
constexpr double kDrawPeriod = 0.2;  // [s] a marker moves this often at most

std_msgs::ColorRGBA colour(std::uint8_t state) {
  using Status = ttsdf_localization::LocalizationStatus;
  std_msgs::ColorRGBA c;
  c.a = 1.0F;
  c.r = state == Status::TRACKING ? 0.1F : 0.95F;
  c.g = state == Status::LOST || state == Status::ERROR || state == Status::NO_MAP ? 0.15F : 0.75F;
  c.b = 0.1F;
  return c;
}

/// First free "map_N.ttsdf" of the folder.
std::string newMapFile(const std::string& folder) {
  for (int n = 1;; ++n) {
    const std::string path = folder + "/map_" + std::to_string(n) + ".ttsdf";
    if (!std::filesystem::exists(path)) return path;
  }
}

}  // namespace

const OptionTable<OperatorMenuOptions>& operatorMenuOptionTable() {
  using O = OperatorMenuOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("localization", &O::localization, {}, "Name of the localization node.")
          .add("map_builder", &O::map_builder, {}, "Name of the map builder.")
          .add("map_folder", &O::map_folder, {},
               "Folder whose maps are offered for loading, and where a built map is saved. Empty: neither is "
               "offered.")
          .add("global_frame_id", &O::global_frame_id, {}, "Frame of the map, until a status names it.")
          .add("height", &O::height, 0.0, 100.0, "m", "Height of the ball above the base.")
          .add("text_size", &O::text_size, 0.01, 10.0, "m", "Height of a letter.");
  return table;
}

std::vector<std::string> mapFiles(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".ttsdf") files.push_back(entry.path().filename().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string statusText(const ttsdf_localization::LocalizationStatus& status, const std::string& last_reply) {
  std::string text = status.state_name.empty() ? "no status" : status.state_name;
  if (status.pose_valid) {
    char figures[80];
    std::snprintf(figures, sizeof(figures), "  inliers %.0f %%, rms %.0f mm", 100.0 * status.inlier_ratio,
                  1000.0 * status.rms_residual);
    text += figures;
  } else if (!status.message.empty()) {
    text += "\n" + status.message;
  }
  if (!last_reply.empty()) text += "\n" + last_reply;
  return text;
}

OperatorMenu::OperatorMenu(const ros::NodeHandle& node, const ros::NodeHandle& private_node)
    : options_(loadOptions(operatorMenuOptionTable(), private_node)),
      node_(node),
      server_("operator"),
      frame_(options_.global_frame_id) {
  position_.z = options_.height;
  text_ = node_.advertise<visualization_msgs::Marker>("operator/text", 1, true);
  draw();
  status_subscriber_ = node_.subscribe("status", 10, &OperatorMenu::onStatus, this);
  pose_subscriber_ = node_.subscribe("pose", 2, &OperatorMenu::onPose, this);
  draw_timer_ =
      node_.createWallTimer(ros::WallDuration(kDrawPeriod), [this](const ros::WallTimerEvent&) { draw(); });
  worker_ = std::thread(&OperatorMenu::run, this);
}

OperatorMenu::~OperatorMenu() {
  draw_timer_.stop();
  actions_.close();
  worker_.join();
}

template <class Service>
OperatorMenu::Action OperatorMenu::call(const std::string& service, const Service& request) {
  return [this, service, request] {
    Service call = request;
    const std::string name = node_.resolveName(service);
    if (!ros::service::exists(name, false)) return service + ": there is no such service";
    if (!ros::service::call(name, call)) return service + ": the call failed";
    return service + (call.response.success ? ": " : " refused: ") + call.response.message;
  };
}

void OperatorMenu::addEntry(const std::string& title, Action action) {
  menu_.insert(title, [this, action](const interactive_markers::MenuHandler::FeedbackConstPtr&) {
    actions_.put(action);  // a call takes seconds; the menu must not stand still
  });
}

void OperatorMenu::fillMenu() {
  using namespace ttsdf_localization;
  const std::string& localizer = options_.localization;
  GlobalLocalization global;
  addEntry("Global localization", call(localizer + "/global_localization", global));
  global.request.cancel = true;
  addEntry("Cancel global localization", call(localizer + "/global_localization", global));
  Relocalize near;
  near.request.use_last_pose = true;
  addEntry("Search near the last pose", call(localizer + "/relocalize", near));
  std_srvs::SetBool pause;
  pause.request.data = true;
  addEntry("Pause", call(localizer + "/pause", pause));
  pause.request.data = false;
  addEntry("Go on", call(localizer + "/pause", pause));
  addEntry("Forget the pose", call(localizer + "/reset", std_srvs::Trigger()));
  if (options_.map_folder.empty()) return;
  addEntry("Build a map and save it", [this] {
    BuildMap build;
    build.request.filename = newMapFile(options_.map_folder);
    return call(options_.map_builder + "/build_map", build)();
  });
  addMaps();
}

void OperatorMenu::addMaps() {
  const auto parent = menu_.insert("Load a map");
  for (const std::string& file : mapFiles(options_.map_folder)) {
    ttsdf_localization::LoadMap load;
    load.request.filename = options_.map_folder + "/" + file;
    const Action action = call(options_.localization + "/load_map", load);
    menu_.insert(parent, file, [this, action](const interactive_markers::MenuHandler::FeedbackConstPtr&) {
      actions_.put(action);
    });
  }
}

void OperatorMenu::run() {
  while (const auto action = actions_.take()) {
    std::string reply;
    try {
      reply = (*action)();
    } catch (const std::exception& error) {
      reply = error.what();
    }
    ROS_INFO_STREAM("operator: " << reply);
    const std::lock_guard<std::mutex> lock(mutex_);
    reply_ = reply;
    menu_stale_ = true;  // there may be a new map in the folder
  }
}

void OperatorMenu::onStatus(const Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  status_ = status;
  if (status.header.frame_id.empty() || status.header.frame_id == frame_) return;
  frame_ = status.header.frame_id;
  menu_stale_ = true;
}

void OperatorMenu::onPose(const geometry_msgs::PoseWithCovarianceStamped& pose) {
  const std::lock_guard<std::mutex> lock(mutex_);
  position_ = pose.pose.pose.position;
  position_.z += options_.height;
}

void OperatorMenu::insertBall(const std::string& frame) {
  visualization_msgs::Marker ball;
  ball.type = visualization_msgs::Marker::SPHERE;
  ball.scale.x = ball.scale.y = ball.scale.z = options_.text_size;
  ball.color.r = 0.2F;
  ball.color.g = 0.4F;
  ball.color.b = ball.color.a = 1.0F;
  visualization_msgs::InteractiveMarkerControl control;
  control.name = "menu";
  control.interaction_mode = visualization_msgs::InteractiveMarkerControl::MENU;
  control.always_visible = true;
  control.markers = {ball};
  visualization_msgs::InteractiveMarker marker;
  marker.header.frame_id = frame;
  marker.name = kMarker;
  marker.description = "localization";
  marker.scale = static_cast<float>(options_.text_size);
  marker.pose.orientation.w = 1.0;
  marker.controls = {control};
  server_.insert(marker);
  menu_ = interactive_markers::MenuHandler();
  fillMenu();
  menu_.apply(server_, kMarker);
}

void OperatorMenu::draw() {
  // The ball is only moved: rviz closes an open menu when its marker is sent anew.
  visualization_msgs::Marker words;
  geometry_msgs::Pose pose;
  pose.orientation.w = 1.0;
  bool stale;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stale = std::exchange(menu_stale_, false);
    pose.position = position_;
    words.header.frame_id = frame_;
    words.text = statusText(status_, reply_);
    words.color = colour(status_.state);
  }
  if (stale) insertBall(words.header.frame_id);
  server_.setPose(kMarker, pose);
  server_.applyChanges();
  words.ns = kMarker;
  words.type = visualization_msgs::Marker::TEXT_VIEW_FACING;
  words.scale.z = options_.text_size;
  words.pose = pose;
  words.pose.position.z += 2.0 * options_.text_size;
  text_.publish(words);
}

}  // namespace ttsdf

#include "ttsdf_localization/ros/offline_run.h"

#include <chrono>
#include <iostream>

#include "ttsdf_localization/ros/map_source.h"
#include "ttsdf_localization/ros/offline_report.h"
#include "ttsdf_localization/ros/yaml_parameters.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/progress.h"

namespace ttsdf {

namespace {

struct Arguments {
  std::string bag, map, config, trajectory, statuses;
  std::vector<std::string> settings;
  BagTopics topics;
  bool times = false;
};

bool parse(int argc, char** argv, Arguments& a) {
  CommandLine line(
      "offline_localizer", "BAG.bag --map MAP.ttsdf [options]",
      "Localizes the camera of a bag in a map with the localizer of the node: without a master, every "
      "scan, as fast as it goes, and with the same result every time.");
  line.positional("BAG.bag", a.bag)
      .value("map", "MAP.ttsdf", a.map, "The map; default: map_file of the parameters.")
      .value("config", "FILE.yaml", a.config,
             "Parameters as for localization_node (config/localization.yaml).")
      .value("set", "KEY=VALUE", a.settings,
             "One parameter more, as odom_frame_id=none or gates/min_inlier_ratio=0.3.")
      .value("cloud", "TOPIC", a.topics.cloud, "PointCloud2; not needed if the bag has only one such topic.")
      .value("depth", "TOPIC", a.topics.depth,
             "Depth images to make the clouds from, if the bag has no clouds.")
      .value("camera-info", "TOPIC", a.topics.camera_info, "Default: camera_info beside the images.")
      .value("initialpose", "TOPIC", a.topics.initial_pose, "Start poses.")
      .value("imu", "TOPIC", a.topics.imu, "For gravity_source imu.")
      .value("trajectory", "FILE", a.trajectory, "Poses as TUM lines: time x y z qx qy qz qw.")
      .value("statuses", "FILE.csv", a.statuses, "One line per scan.")
      .flag("times", a.times, "Add the milliseconds of every registration to the statuses.");
  return line.parse(argc, argv, std::cout);
}

LocalizationRosOptions readOptions(const Arguments& a) {
  XmlRpc::XmlRpcValue tree;
  if (!a.config.empty()) tree = parametersFromFile(a.config);
  LocalizationRosOptions options;
  try {
    for (const std::string& setting : a.settings) setParameter(tree, setting);
    localizationParameters(options).load(tree, a.config.empty() ? "--set" : a.config);
    if (!a.map.empty()) options.map.map_file = a.map;
    checkAndTidy(options);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  if (options.map.map_file.empty()) throw UsageError("--map is missing");
  return options;
}

}  // namespace

int runOfflineLocalizer(int argc, char** argv) {
  Arguments arguments;
  if (!parse(argc, argv, arguments)) return 0;
  const LocalizationRosOptions options = readOptions(arguments);
  rosbag::Bag bag;
  try {
    bag.open(arguments.bag, rosbag::bagmode::Read);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error("bag '" + arguments.bag + "': " + error.what());
  }
  const BagTopics topics = findTopics(bag, arguments.topics);
  LoadedMap map = prepareMapFile(options.map.map_file, options.map, options.localizer.registration);
  std::cout << map.summary << '\n';

  OfflineReport report(arguments.trajectory, arguments.statuses, arguments.times);
  BagLocalizer localizer(options, std::move(map.map),
                         [&report](const std_msgs::Header& header, const BagLocalizer::Status& status,
                                   const LocalizationUpdate& update) { report.add(header, status, update); });
  const auto begin = std::chrono::steady_clock::now();
  {
    Progress progress;
    play(bag, topics, localizer, [&](double share) { progress.update("localizing", share); });
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  for (const std::string& warning : localizer.warnings())
    std::cerr << "offline_localizer: warning: " << warning << '\n';
  report.close();
  std::cout << report.summary(seconds.count(), localizer.globalLocalizations());
  if (report.scans() == 0) throw std::runtime_error("bag '" + arguments.bag + "': got no scan, wanted some");
  return 0;
}

}  // namespace ttsdf

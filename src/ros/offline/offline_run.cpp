#include "ros/offline/offline_run.h"

#include <json/value.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "ros/maps/map_source.h"
#include "ros/offline/offline_report.h"
#include "ros/parameters/yaml_parameters.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/json_file.h"
#include "ttsdf_localization/tools/printable.h"
#include "ttsdf_localization/tools/progress.h"

namespace ttsdf {

namespace {

constexpr int kNoPose = 3;  // exit code: everything could be read, and nothing localized
constexpr char kReindex[] = "(rosbag reindex may save what is whole)";

/// What people take for a bag, by its first bytes.
void checkKindOfBag(const std::string& path) {
  const auto refuse = [&path](const std::string& got) {
    throw std::runtime_error("bag '" + path + "': got " + got + ", wanted a bag of ROS 1 (#ROSBAG V2.0)");
  };
  if (std::filesystem::is_directory(path)) {
    refuse(std::filesystem::exists(path + "/metadata.yaml")
               ? "a bag of ROS 2 (convert it with rosbags-convert)"
               : "a folder");
  }
  std::ifstream file(path, std::ios::binary);
  std::string begin(16, '\0');
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  if (file.gcount() == 0) refuse(file.is_open() ? "an empty file" : "no file");
  if (begin.rfind("SQLite format 3", 0) == 0)
    refuse("a database of ROS 2 (convert its folder with rosbags-convert)");
  if (begin.rfind("\x89MCAP", 0) == 0) refuse("an MCAP file (convert it with rosbags-convert)");
  if (begin.rfind("#ROSBAG V", 0) != 0) refuse("another kind of file");
  if (begin.rfind("#ROSBAG V2.0", 0) != 0) refuse("a bag of an old format (rosbag fix, rosbag reindex)");
}

void openBag(const std::string& path, rosbag::Bag& bag) {
  checkKindOfBag(path);
  try {
    bag.open(path, rosbag::bagmode::Read);
  } catch (const rosbag::BagUnindexedException&) {
    throw std::runtime_error("bag '" + path + "': has no index: its recording was cut off " + kReindex);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error("bag '" + path + "': is damaged or cut off: " + error.what() + " " + kReindex);
  }
}

struct Arguments {
  std::string bag, map, config, trajectory, covariances, statuses, summary;
  std::vector<std::string> settings;
  BagTopics topics;
  bool times = false;
};

bool parse(int argc, char** argv, Arguments& a) {
  CommandLine line(
      "offline_localizer", "BAG.bag --map MAP.ttsdf [options]",
      "Localizes the camera of a bag in a map with the localizer of the node: without a master, as fast as "
      "it "
      "goes, and with the same result every time. Every scan is used, but for those that max_rate and "
      "update_min_* skip.");
  line.positional("BAG.bag", a.bag)
      .value("map", "MAP.ttsdf", a.map, "The map; default: map_file of the parameters.")
      .value("config", "FILE.yaml", a.config,
             "Parameters as for localization_node (config/localization.yaml).")
      .value("set", "KEY=VALUE", a.settings,
             "One parameter more, as odom_frame_id=none or gates/min_inlier_ratio=0.3.")
      .value("cloud", "TOPIC", a.topics.cloud, "PointCloud2; not needed if the bag has only one such topic.")
      .value("depth", "TOPIC", a.topics.depth,
             "Depth images (compressedDepth, too), if the bag has no clouds.")
      .value("camera-info", "TOPIC", a.topics.camera_info, "Default: camera_info beside the images.")
      .value("initialpose", "TOPIC", a.topics.initial_pose, "Start poses.")
      .value("imu", "TOPIC", a.topics.imu, "For gravity_source imu.")
      .value("trajectory", "FILE", a.trajectory, "Poses as TUM lines: time x y z qx qy qz qw.")
      .value("covariances", "FILE.csv", a.covariances,
             "Covariances of the poses: stamp, c00 to c55 (ROS's order: x y z, then rotations).")
      .value("statuses", "FILE.csv", a.statuses, "One line per scan.")
      .value("summary", "FILE.json", a.summary,
             "Scans, poses, times_lost, reason (why there is no pose), map_memory_bytes, median_ms.")
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
  if (!arguments.summary.empty()) requireWritable(arguments.summary);
  rosbag::Bag bag;
  openBag(arguments.bag, bag);
  const BagTopics topics = findTopics(bag, arguments.topics);
  LoadedMap map = prepareMapFile(options.map.map_file, options.map, options.localizer.registration);
  std::cout << map.summary << '\n';
  const auto map_memory_bytes = static_cast<Json::UInt64>(map.map.field->memoryBytes());

  OfflineReport report({arguments.trajectory, arguments.covariances, arguments.statuses}, arguments.times);
  BagLocalizer localizer(options, std::move(map.map),
                         [&report](const std_msgs::Header& header, const BagLocalizer::Status& status,
                                   const LocalizationUpdate& update) { report.add(header, status, update); });
  const auto begin = std::chrono::steady_clock::now();
  {
    Progress progress;
    try {
      play(bag, topics, localizer, [&](double share) { progress.update("localizing", share); });
    } catch (const rosbag::BagException& error) {
      throw std::runtime_error("bag '" + arguments.bag + "': is damaged or cut off: " + error.what() + " " +
                               kReindex);
    }
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  for (const std::string& warning : localizer.warnings())
    std::cerr << "offline_localizer: warning: " << printable(warning) << '\n';
  report.close();
  std::cout << report.summary(seconds.count(), localizer.globalLocalizations());
  const std::string reason = report.reasonForNoPose();
  if (!arguments.summary.empty()) {
    Json::Value summary;
    summary["scans"] = report.scans();
    summary["poses"] = report.poses();
    summary["times_lost"] = report.timesLost();
    summary["reason"] = reason;
    summary["map_memory_bytes"] = map_memory_bytes;
    summary["median_ms"] = report.medianMilliseconds();
    writeJson(arguments.summary, summary);
  }
  if (reason.empty()) return 0;
  std::cerr << "offline_localizer: no pose: " << printable(reason) << '\n';
  return kNoPose;
}

}  // namespace ttsdf

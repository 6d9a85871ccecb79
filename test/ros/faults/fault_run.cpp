// The localizer under faults for as long as one likes: scans of the analytic room in simulated time, a random
// fault in one of 300 scans, and what state, transforms, diagnostics and poses said about it. Prints a table,
// one line per kind of fault.
//
// usage: fault_run --map FILE --other-map FILE [--scans N] [--speed X] [--one-in N] [--seed N] [--only REGEX]
// (with a ROS master; --only: the faults whose names match)

#include <ros/ros.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <regex>
#include <thread>

#include "fault_checks.h"
#include "fault_injection.h"
#include "fault_kinds.h"
#include "ros/node/localization_ros.h"

namespace ttsdf {
namespace {

using Wall = std::chrono::steady_clock;

constexpr int kMemoryLooks = 10;      // in the whole run
constexpr double kFirstQuiet = 10.0;  // [s] without a fault at the beginning ...
constexpr double kQuiet = 3.0;        // ... and after a fault
constexpr double kPosePeriod = 5.0;   // [s] between two start poses for a robot that is not tracked

class Run {
 public:
  Run(const std::string& map, const std::string& other, int scans, double speed, unsigned one_in,
      unsigned seed, const std::string& only)
      : scans_(scans),
        speed_(speed),
        one_in_(one_in),
        only_(only),
        random_(seed),
        private_node_("~"),
        robot_(node_, private_node_, {map, other}, random_),
        checks_(node_) {
    private_node_.setParam("map_file", map);
    private_node_.setParam("recovery/allow_global", false);
  }

  int run() {
    ros::AsyncSpinner spinner(2);
    spinner.start();
    robot_.setClock(kStart);
    LocalizationRos localizer(node_, private_node_, "localization");
    for (int n = 0; n < 600 && ros::ok() && !checks_.hasMap(); ++n)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    robot_.givePose();
    const int scans_per_memory = std::max(1, scans_ / kMemoryLooks);
    int sent = 0;
    for (; sent < scans_ && ros::ok(); ++sent) {
      step(sent);
      if ((sent + 1) % scans_per_memory == 0) checks_.noteMemory();
    }
    checks_.end();
    return checks_.report(sent, scans_per_memory) ? 0 : 1;
  }

 private:
  void step(int scan) {
    robot_.setClock(robot_.now() + kPeriod);
    const Wall::time_point begin = Wall::now();
    if (fault_ != Fault::kNone && robot_.now() > fault_end_) end();
    const bool may_begin = fault_ == Fault::kNone && robot_.now() > quiet_until_;
    if (may_begin && checks_.isTracking() && random_() % one_in_ == 0) inject(scan);
    const bool calm = fault_ == Fault::kNone && robot_.now() > quiet_until_;
    if (calm && !checks_.isTracking() && robot_.now() - last_pose_given_ > kPosePeriod) {
      last_pose_given_ = robot_.now();
      robot_.givePose();
    }
    robot_.moveOn();
    checks_.noteScan(scan, ros::Time(robot_.now()), robot_.pose(), calm);
    robot_.send(scan);
    std::this_thread::sleep_until(
        begin + std::chrono::duration_cast<Wall::duration>(std::chrono::duration<double>(kPeriod / speed_)));
  }

  void inject(int scan) {
    do {
      fault_ = static_cast<Fault>(1 + random_() % (static_cast<unsigned>(Fault::kCount) - 1));
    } while (!std::regex_search(nameOf(fault_), only_));
    ROS_INFO("scan %d: %s", scan, nameOf(fault_));
    checks_.begin(fault_);
    robot_.begin(fault_);
    fault_end_ = robot_.now() + secondsOf(fault_);
  }

  void end() {
    checks_.end();
    robot_.end();
    fault_ = Fault::kNone;
    quiet_until_ = robot_.now() + kQuiet;
  }

  const int scans_;
  const double speed_;
  const unsigned one_in_;
  const std::regex only_;  ///< names of the faults to inject
  std::mt19937 random_;
  ros::NodeHandle node_, private_node_;
  FaultyRobot robot_;
  FaultChecks checks_;
  Fault fault_ = Fault::kNone;
  double fault_end_ = 0.0, quiet_until_ = kStart + kFirstQuiet, last_pose_given_ = kStart;  ///< [s]
};

}  // namespace
}  // namespace ttsdf

int main(int argc, char** argv) {
  ros::init(argc, argv, "localization");
  // Before the first NodeHandle: roscpp asks for it once, when that is made.
  ros::param::set("/use_sim_time", true);
  std::string map, other, only;
  int scans = 3000;
  double speed = 4.0;
  unsigned one_in = 300, seed = 1;
  for (int n = 1; n + 1 < argc; n += 2) {
    const std::string name = argv[n], value = argv[n + 1];
    if (name == "--map") map = value;
    if (name == "--other-map") other = value;
    if (name == "--scans") scans = std::stoi(value);
    if (name == "--speed") speed = std::stod(value);
    if (name == "--one-in") one_in = static_cast<unsigned>(std::stoul(value));
    if (name == "--only") only = value;
    if (name == "--seed") seed = static_cast<unsigned>(std::stoul(value));
  }
  if (map.empty() || other.empty()) {
    std::fprintf(
        stderr,
        "usage: fault_run --map FILE --other-map FILE [--scans N] [--speed X] [--one-in N] [--seed N] "
        "[--only REGEX]\n");
    return 2;
  }
  try {
    std::regex check(only);
  } catch (const std::regex_error& error) {
    std::fprintf(stderr, "--only: got '%s', wanted a regular expression (%s)\n", only.c_str(), error.what());
    return 2;
  }
  const auto matches = [&only](const char* name) { return std::regex_search(name, std::regex(only)); };
  if (std::none_of(std::begin(ttsdf::kNames) + 1, std::end(ttsdf::kNames), matches)) {
    std::fprintf(stderr, "--only: got '%s', which is the name of no fault\n", only.c_str());
    return 2;
  }
  return ttsdf::Run(map, other, scans, speed, one_in, seed, only).run();
}

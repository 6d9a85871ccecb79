#include "hotel_benchmark.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>

#include "ttsdf_localization/simulation/trajectory.h"

namespace ttsdf {

double since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

double threadSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

long threadWaits() {
  rusage use{};
  getrusage(RUSAGE_THREAD, &use);
  return use.ru_nvcsw;
}

double resident() {
  std::ifstream file("/proc/self/statm");
  double total = 0.0, pages = 0.0;
  file >> total >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return NAN;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

DepthCamera cameraOf(double width_degrees) {
  DepthCameraOptions options;
  options.width = 160, options.height = 120;
  options.fx = options.fy = 80.0 / std::tan(0.5 * width_degrees * M_PI / 180.0);
  options.noise = depthNoise("kinect");
  options.max_range = 5.0;
  return DepthCamera(options);
}

ScanPoints scanOf(const DepthCamera& camera, const Hotel& hotel, const Eigen::Isometry3d& T_map_camera,
                  std::uint64_t frame) {
  return toPoints(camera.render(hotel.scene, T_map_camera, frame), camera.intrinsics(), 2, 0.2, 5.0);
}

std::vector<Eigen::Isometry3d> wayFrom(const Hotel& hotel, const HotelRoom& room, double rate) {
  const auto poses = Trajectory(hotel.tours[static_cast<std::size_t>(room.storey)], false).sample(rate);
  const Eigen::Vector2d inside = room.door + Eigen::Vector2d(0.1, room.north ? 1.2 : -1.2);
  const auto apart = [&](const StampedPose& pose) {
    return (pose.T_map_base.translation().head<2>() - inside).norm();
  };
  auto first = std::min_element(poses.begin(), poses.end(), [&](const StampedPose& a, const StampedPose& b) {
    return apart(a) < apart(b);
  });
  std::vector<Eigen::Isometry3d> way;
  for (; first != poses.end(); ++first) way.push_back(first->T_map_base);
  return way;
}

}  // namespace ttsdf

#pragma once
// What the programs about the simulated hotel share.

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "ttsdf_localization/registration/registration.h"
#include "ttsdf_localization/simulation/depth_camera.h"
#include "ttsdf_localization/simulation/hotel.h"

namespace ttsdf {

using Clock = std::chrono::steady_clock;
double since(Clock::time_point begin);  ///< [s]
double threadSeconds();                 ///< processor time of this thread [s]
long threadWaits();                     ///< how often this thread waited for something
double resident();                      ///< memory of this process [MB]
double quantile(std::vector<double> values, double share);

DepthCamera cameraOf(double width_degrees);
ScanPoints scanOf(const DepthCamera& camera, const Hotel& hotel, const Eigen::Isometry3d& T_map_camera,
                  std::uint64_t frame);
/// Poses of the robot from a look round in a room on, along the tour of its storey.
std::vector<Eigen::Isometry3d> wayFrom(const Hotel& hotel, const HotelRoom& room, double rate);

/// Scans in the rooms, without a prior, gravity known.
void whichMap(const std::string& folder, const Hotel& hotel, int count, double width, int max_maps);
/// How far the robot has to drive from a room on until the atlas knows where it is, without a prior. `drift`:
/// of the odometry [m/m], [rad/m].
void locateMoving(const std::string& folder, const Hotel& hotel, int count, double width, double metres,
                  double drift, double megabytes, double map_megabytes);

}  // namespace ttsdf

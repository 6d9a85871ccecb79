#pragma once
// How far the readings of a range sensor can be trusted. One model weighs the fusion of maps and the
// registration of scans; the simulation makes its noise from the same one.

#include <string>
#include <vector>

namespace ttsdf {

struct SensorModel {
  /// Standard deviation of a reading: noise + noise_linear range + noise_quadratic range^2 [m].
  double noise = 0.0;            ///< [m]
  double noise_linear = 0.0;     ///< [m/m]
  double noise_quadratic = 0.0;  ///< [1/m]: triangulation, whose error is a constant of inverse depth
  double grazing_angle = 0.0;    ///< readings of surfaces seen at less than this angle are not used [rad]
  /// Readings beside depth discontinuities mix foreground and background, or fly between them.
  bool mixes_edges = false;

  double sigma(double range) const { return noise + range * (noise_linear + range * noise_quadratic); }
  /// Weight in (0, 1] of a reading at `range` where everything else is off by `floor` [m]: their share of the
  /// variance. 1 for an exact sensor.
  double weight(double range, double floor) const {
    const double sensor = sigma(range), rest = floor * floor;
    return sensor > 0.0 ? rest / (rest + sensor * sensor) : 1.0;
  }
};

// clang-format off
/// kinect | realsense_d435 | orbbec | time_of_flight | lidar | exact. Throws std::invalid_argument for
/// another name. With the noise [mm] at 1 and 3 m, and where it is from:
///
/// - kinect, 1.9 and 13: structured light, the first Kinect and similar cameras; Khoshelham and Elberink 2012
/// - realsense_d435, 3.5 and 24: active stereo, 50 mm baseline; 0.08 pixel of disparity, Intel's tuning guide
/// - orbbec, 3.0 and 19: structured light and stereo of Astra and Gemini; 3 mm at 1 m, the maker's data sheets
/// - time_of_flight, 4.5 and 7.5: Azure Kinect, Kinect v2, flying pixels at edges; data sheet, Tölgyessy et al. 2021
/// - lidar, 15 and 16: spinning and solid state lidars; 1 to 3 cm, hardly more at long range
/// - exact, 0 and 0: simulated scans, CAD models; every reading counts the same
// clang-format on
SensorModel sensorModel(const std::string& name);
const std::vector<std::string>& sensorNames();

}  // namespace ttsdf

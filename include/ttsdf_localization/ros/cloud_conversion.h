#pragma once
// sensor_msgs/PointCloud2 -> points for the registration: bounded, finite, in range.

#include <sensor_msgs/PointCloud2.h>

#include "ttsdf_localization/options/option_table.h"
#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {

struct CloudOptions {
  double min_range = 0.2;  ///< nearer points are dropped [m]
  double max_range = 6.0;  ///< farther points are dropped [m]; distance from the sensor, before any transform
  int max_points = 5000;   ///< points looked at; a larger cloud is sub-sampled first
};
const OptionTable<CloudOptions>& cloudOptionTable();

struct ConvertedCloud {
  ScanPoints points;     ///< sensor frame [m]
  int touched = 0;       ///< points looked at
  int not_finite = 0;    ///< of them NaN or infinite
  int out_of_range = 0;  ///< of them too near or too far
};

/// Reads x, y, z as float32 or float64 at any offset, padding and alignment, in either byte order. An
/// organised cloud is sub-sampled by a stride in both directions, any other by a stride; at most `max_points`
/// points are read. An empty cloud gives no points. Throws std::invalid_argument for a cloud that cannot be
/// read (what, got, wanted).
ConvertedCloud convertCloud(const sensor_msgs::PointCloud2& cloud, const CloudOptions& options);

/// Every point, row by row, as it is (NaN included): for those who need the order of an organised cloud.
/// Errors as above.
ScanPoints allPoints(const sensor_msgs::PointCloud2& cloud);

/// The other way: an unorganised float32 cloud.
sensor_msgs::PointCloud2 toCloudMessage(const ScanPoints& points, const std_msgs::Header& header);

}  // namespace ttsdf

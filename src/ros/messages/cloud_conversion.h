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
  ScanPoints points;              ///< sensor frame [m]
  int touched = 0;                ///< points looked at
  int not_finite = 0;             ///< of them NaN or infinite
  int out_of_range = 0;           ///< of them too near or too far
  bool wrong_byte_order = false;  ///< the message's flag lies: it was read the other way round
};

/// Steps that leave at most `max_points` of width x height points; an organised cloud is thinned both ways.
struct Stride {
  std::size_t row = 1, column = 1;
};
Stride chooseStride(std::size_t width, std::size_t height, int max_points);
bool hostIsBigEndian();

/// Keeps what is finite and in range.
class PointFilter {
 public:
  PointFilter(const CloudOptions& options, ConvertedCloud& result);
  /// Cuts the points to what was kept.
  ~PointFilter();
  PointFilter(const PointFilter&) = delete;
  PointFilter& operator=(const PointFilter&) = delete;
  void add(float x, float y, float z);
  void skip() { ++result_.touched, ++result_.not_finite; }  ///< no reading there

 private:
  const float min_squared_, max_squared_;
  ConvertedCloud& result_;
  Eigen::Index kept_ = 0;
};

/// Reads x, y, z as float32 or float64 at any offset, padding and alignment, in either byte order; where the
/// flag of the byte order makes nonsense of nearly all points and the other order does not, the other one is
/// taken. row_step may be 0 or the size of the whole cloud, as some drivers have it, where the data are
/// packed. An organised cloud is sub-sampled by a stride in both directions, any other by a stride; at most
/// `max_points` points are read. An empty cloud gives no points. Throws std::invalid_argument for a cloud
/// that cannot be read (what, got, wanted).
ConvertedCloud convertCloud(const sensor_msgs::PointCloud2& cloud, const CloudOptions& options);

/// Every point, row by row, as it is (NaN included): for those who need the order of an organised cloud.
/// Errors as above.
ScanPoints allPoints(const sensor_msgs::PointCloud2& cloud);

/// The other way: an unorganised float32 cloud.
sensor_msgs::PointCloud2 toCloudMessage(const ScanPoints& points, const std_msgs::Header& header);

}  // namespace ttsdf

#pragma once
// Whether a box can be built, told before the work; and what makes it as large as it is.

#include <Eigen/Core>
#include <string>
#include <vector>

namespace ttsdf {

/// "3 of 11 vertices lie more than 97 m from the rest, the farthest at 100 0 0"; empty if no few points lie
/// far from all others. `what`: the plural of what the points are.
std::string describeOutliers(const std::vector<Eigen::Vector3d>& points, const std::string& what);

/// What of a box's building takes the memory.
struct ExtentCost {
  double bytes_per_sample = 0.0;  ///< 0: of a fused volume: dense up to 30 million samples, in tiles beyond
  double bytes_besides = 0.0;
};

/// Throws std::invalid_argument for a box that cannot be built at this voxel size: more samples than a map
/// can have, or more memory than this machine has free. The message says how large it is, names outliers
/// among `points`, and ends with `hint`.
void checkExtent(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double voxel_size,
                 const std::vector<Eigen::Vector3d>& points, const std::string& what, const std::string& hint,
                 const ExtentCost& cost = {});

/// "" or one line: the points are floats (or were) so far from zero that their steps show in voxels.
std::string describeRounding(const std::vector<Eigen::Vector3d>& points, double voxel_size);

/// Throws std::invalid_argument for what is smaller than a voxel: other units.
void refuseTiny(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double voxel_size);

}  // namespace ttsdf

#include "ttsdf_localization/build_steps/extent.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace ttsdf {

namespace {

// The limits of a sampled field: offsets of the distance transform are 16-bit numbers.
constexpr double kMaxSum = 16000.0, kMaxSamples = 2147483648.0;
// Larger grids are sampled in tiles.
constexpr double kDenseSamples = 3e7, kDenseBytes = 40.0, kTiledBytes = 2.0;

double freeMemory() {
  std::ifstream in("/proc/meminfo");
  for (std::string key; in >> key;) {
    double kilobytes = 0.0;
    if (key == "MemAvailable:" && in >> kilobytes) return 1024.0 * kilobytes;
  }
  return 1e300;  // unknown: not what refuses
}

}  // namespace

std::string describeOutliers(const std::vector<Eigen::Vector3d>& points, const std::string& what) {
  constexpr double kFew = 0.3, kTimes = 5.0;
  if (points.size() < 5) return {};
  Eigen::Vector3d median;
  std::vector<double> values(points.size());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [axis](const Eigen::Vector3d& p) { return p[axis]; });
    std::nth_element(values.begin(), middle, values.end());
    median[axis] = *middle;
  }
  std::vector<std::pair<double, std::size_t>> distances;
  for (std::size_t n = 0; n < points.size(); ++n) distances.emplace_back((points[n] - median).norm(), n);
  std::sort(distances.begin(), distances.end());
  // The largest gap among the farthest: everything behind it lies apart.
  const auto first = static_cast<std::size_t>((1.0 - kFew) * static_cast<double>(points.size()));
  std::size_t apart = points.size();
  for (std::size_t n = std::max<std::size_t>(first, 1); n < points.size(); ++n) {
    if (distances[n].first > kTimes * std::max(distances[n - 1].first, 1e-9)) apart = n;
    if (apart < points.size()) break;
  }
  if (apart == points.size()) return {};
  const Eigen::Vector3d& farthest = points[distances.back().second];
  std::ostringstream text;
  text << points.size() - apart << " of " << points.size() << ' ' << what << " lie " << distances[apart].first
       << " m or more from the others' middle (the others at most " << distances[apart - 1].first
       << " m), the farthest at " << farthest.transpose();
  return text.str();
}

std::string describeRounding(const std::vector<Eigen::Vector3d>& points, double voxel_size) {
  constexpr double kCoarse = 0.25;  // voxels
  double farthest = 0.0;
  for (const Eigen::Vector3d& p : points) {
    if (!p.allFinite()) continue;
    const Eigen::Vector3d single = p.cast<float>().cast<double>();
    if (single != p) return {};
    farthest = std::max(farthest, p.cwiseAbs().maxCoeff());
  }
  const auto value = static_cast<float>(farthest);
  const double step =
      static_cast<double>(std::nextafter(value, std::numeric_limits<float>::infinity()) - value);
  if (!(step > kCoarse * voxel_size)) return {};
  std::ostringstream text;
  text << "got coordinates of single precision up to " << farthest << " m from zero, that is in steps of "
       << step << " m: the surface is as coarse (wanted doubles, or coordinates relative to a place nearby)";
  return text.str();
}

void refuseTiny(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double voxel_size) {
  if ((high - low).maxCoeff() >= voxel_size) return;
  std::ostringstream text;
  text << "got a box of " << (high - low).transpose() << " m, which is less than one voxel of " << voxel_size
       << " m; --scale S makes metres of other units (smaller voxels: --voxel-size)";
  throw std::invalid_argument(text.str());
}

void checkExtent(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double voxel_size,
                 const std::vector<Eigen::Vector3d>& points, const std::string& what, const std::string& hint,
                 const ExtentCost& cost) {
  const Eigen::Array3d extents = ((high - low).array() / voxel_size).ceil() + 1.0;
  const double samples = extents.prod();
  double bytes = samples * (cost.bytes_per_sample > 0.0 ? cost.bytes_per_sample : kDenseBytes);
  if (cost.bytes_per_sample <= 0.0 && samples > kDenseSamples) {
    bytes = kDenseSamples * kDenseBytes + kTiledBytes * samples;
  }
  bytes += cost.bytes_besides;
  const double memory = freeMemory();
  const bool fits = extents.sum() <= kMaxSum && samples <= kMaxSamples;
  if (fits && bytes <= memory) return;
  std::ostringstream text;
  text << "got a box of " << (high - low).transpose() << " m, that is " << extents.transpose()
       << " samples at voxels of " << voxel_size << " m, ";
  if (fits) {
    text << "which needs about " << std::round(bytes / 1e6) << " MB, and " << std::round(memory / 1e6)
         << " MB are free";
  } else {
    text << "wanted at most 2^31 samples and extents up to " << kMaxSum << " in sum";
  }
  const std::string outliers = describeOutliers(points, what);
  if (!outliers.empty()) text << "; " << outliers;
  if (!hint.empty()) text << "; " << hint;
  text << " (larger voxels: --voxel-size)";
  throw std::invalid_argument(text.str());
}

}  // namespace ttsdf

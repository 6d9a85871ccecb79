#include "ttsdf_localization/readers/cloud_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "cloud_formats.h"
#include "ply_file.h"

namespace ttsdf {

namespace {

template <class T>
std::vector<T> valuesOf(const FileBytes& file) {
  std::vector<T> values(file.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), file.begin(), values.size() * sizeof(T));
  return values;
}

/// Share of values that may be coordinates in metres: zero, no reading, or up to a thousand kilometres and
/// from a micrometre on; of doubles from what rounding makes of zero.
template <class T>
double plausibleShare(const std::vector<T>& values) {
  constexpr double kSmallest = sizeof(T) == 8 ? 1e-20 : 1e-6, kLargest = 1e7;
  std::size_t plausible = 0;
  for (const T value : values) {
    const double size = std::abs(static_cast<double>(value));
    plausible += size == 0.0 || !std::isfinite(size) || (size > kSmallest && size < kLargest) ? 1 : 0;
  }
  return values.empty() ? 0.0 : static_cast<double>(plausible) / static_cast<double>(values.size());
}

/// Doubles of floats or of round numbers: the lower half of their bits is zero but for the highest three,
/// which every second of true floats would have to be.
bool looksLikeRoundDoubles(const FileBytes& file) {
  constexpr std::uint32_t kNeverOfFloats = 0x1fffffff;
  bool round = file.size() % 24 == 0, zero = true;
  for (std::size_t n = 0; round && n + 8 <= file.size(); n += 8) {
    std::uint32_t halves[2];
    std::memcpy(halves, file.begin() + n, sizeof(halves));
    round = (halves[0] & kNeverOfFloats) == 0;
    zero = zero && halves[1] == 0;
  }
  return round && !zero;
}

/// x y z intensity, as KITTI has it: every fourth value lies from 0 to 1, and the others do not.
bool looksLikeFourColumns(const std::vector<float>& values) {
  if (values.size() % 4 != 0 || values.size() < 40) return false;
  std::size_t unit = 0, others = 0;
  for (std::size_t n = 0; n < values.size(); ++n) {
    const bool in_unit = values[n] >= 0.0f && values[n] <= 1.0f;
    (n % 4 == 3 ? unit : others) += in_unit ? 1 : 0;
  }
  return unit == values.size() / 4 && others * 2 < values.size() / 4 * 3;
}

template <class T>
Eigen::Matrix3Xd asPoints(const std::vector<T>& values) {
  return Eigen::Map<const Eigen::Matrix<T, 3, Eigen::Dynamic>>(values.data(), 3,
                                                               static_cast<Eigen::Index>(values.size() / 3))
      .template cast<double>();
}

}  // namespace

CloudFile readRawCloud(const FileBytes& file) {
  constexpr double kAlmostAll = 0.99, kMost = 0.9;
  CloudFile cloud;
  const auto floats = valuesOf<float>(file);
  if (file.size() % 24 == 0 && (plausibleShare(floats) < kMost || looksLikeRoundDoubles(file))) {
    const auto doubles = valuesOf<double>(file);
    if (plausibleShare(doubles) > kAlmostAll) {
      cloud.points = asPoints(doubles);
      return cloud;
    }
  }
  if (file.size() % 12 != 0 || looksLikeFourColumns(floats)) {
    file.fail("got " + std::to_string(file.size()) + " bytes" +
              (looksLikeFourColumns(floats) ? " that look like x y z intensity" : "") +
              ", wanted float32 x y z (a multiple of 12)");
  }
  if (plausibleShare(floats) < kMost) {
    file.fail(
        "got values that are no coordinates in metres, wanted float32 (or float64) x y z, little endian");
  }
  cloud.points = asPoints(floats);
  return cloud;
}

CloudFile readPlyCloud(const FileBytes& file) {
  const PlyFile ply(file);
  const PlyElement* vertex = ply.find("vertex");
  if (!vertex) file.fail("got no element 'vertex'");
  std::vector<std::size_t> wanted;
  CloudFile cloud;
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) {
    const int p = vertex->find(name);
    const bool found = p >= 0 && !vertex->properties[static_cast<std::size_t>(p)].list;
    if (!found && wanted.size() < 3) file.fail(std::string("got no field '") + name + "', wanted x, y and z");
    if (!found) break;
    wanted.push_back(static_cast<std::size_t>(p));
    if (wanted.size() <= 3 && isWhole(vertex->properties[wanted.back()].type)) cloud.whole_numbers = true;
  }
  const bool normals = wanted.size() == 6;
  const auto count = static_cast<Eigen::Index>(vertex->count);
  cloud.points.resize(3, count);
  cloud.normals.resize(3, normals ? count : 0);
  Eigen::Index n = 0;
  ply.read([&](const PlyElement& element, const PlyItem& item) {
    if (&element != vertex) return;
    for (Eigen::Index c = 0; c < 3; ++c) {
      cloud.points(c, n) = item.scalars[wanted[static_cast<std::size_t>(c)]];
      if (normals)
        cloud.normals(c, n) = static_cast<float>(item.scalars[wanted[static_cast<std::size_t>(c) + 3]]);
    }
    ++n;
  });
  return cloud;
}

namespace {

/// Writers put zeros or NaN where they have no normal. Where many are missing, none is used.
void dropMissingNormals(CloudFile& cloud) {
  constexpr double kMissing = 0.1;
  Eigen::Index missing = 0;
  for (Eigen::Index n = 0; n < cloud.normals.cols(); ++n)
    missing += cloud.normals.col(n).squaredNorm() > 1e-6F ? 0 : 1;
  if (static_cast<double>(missing) > kMissing * static_cast<double>(cloud.normals.cols()))
    cloud.normals.resize(3, 0);
}

CloudFile readAnyCloud(const std::string& path) {
  const std::string ending = lowerEnding(path);
  const auto is = [&ending](std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(), [&](const char* name) { return ending == name; });
  };
  if (!is({".pcd", ".ply", ".bin", ".xyz", ".txt", ".pts", ".asc", ".csv", ".xyzn"})) {
    throw std::runtime_error("scan '" + path + "': got ending '" + ending +
                             "', wanted .pcd, .ply, .xyz, .csv or .bin");
  }
  std::error_code error;
  if (is({".bin"}) && std::filesystem::is_regular_file(path) && std::filesystem::file_size(path, error) == 0)
    return {};
  const FileBytes file("scan", path);
  if (is({".pcd"})) return readPcd(file);
  if (is({".ply"})) return readPlyCloud(file);
  if (is({".bin"})) return readRawCloud(file);
  return readTextCloud(file);
}

}  // namespace

CloudFile readCloudFile(const std::string& path) {
  CloudFile cloud = readAnyCloud(path);
  dropMissingNormals(cloud);
  return cloud;
}

Eigen::Matrix3Xf readScanFile(const std::string& path) {
  const CloudFile cloud = readCloudFile(path);
  if (cloud.whole_numbers) {
    throw std::runtime_error(
        "scan '" + path +
        "': got whole numbers for x y z (millimetres?), wanted float32 or float64 in metres");
  }
  return cloud.points.cast<float>();
}

}  // namespace ttsdf

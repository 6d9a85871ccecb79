#include "intrinsics_files.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

namespace fs = std::filesystem;

namespace {

constexpr double kMaxSide = 65535.0;  // of a side of an image

/// Numbers behind a key of a text in any notation: "fx": 600.0 or fx = 600, "intrinsic_matrix": [ ... ].
std::vector<double> numbersBehind(const std::string& text, const std::string& key, std::size_t count) {
  std::vector<double> values;
  std::size_t at = text.find('"' + key + '"');
  at = at != std::string::npos ? at + key.size() + 2 : text.find(key);
  if (at == std::string::npos) return values;
  if (text.compare(at, key.size(), key) == 0) at += key.size();
  std::string rest = text.substr(at, 4000);
  std::replace_if(
      rest.begin(), rest.end(),
      [](char c) { return c == ',' || c == '[' || c == ']' || c == ':' || c == '='; }, ' ');
  WordCursor words(rest.data(), rest.data() + rest.size());
  for (double value = 0.0; values.size() < count && parseNumber(words.next(), &value);)
    values.push_back(value);
  return values.size() == count ? values : std::vector<double>();
}

std::string textOf(const fs::path& path) {
  const FileBytes file("camera intrinsics", path.string());
  return {file.begin(), std::min<std::size_t>(file.size(), 1 << 16)};
}

/// The image size that a file of intrinsics names; 0: it names none. Throws std::runtime_error for what is no
/// size.
Eigen::Array2i checkedSize(const fs::path& path, double width, double height) {
  const auto valid = [](double pixels) { return pixels >= 0.0 && pixels <= kMaxSide; };
  if (valid(width) && valid(height)) return {static_cast<int>(width), static_cast<int>(height)};
  std::ostringstream text;
  text << "camera intrinsics '" << path.string() << "': got an image size of " << width << " x " << height
       << ", wanted at most " << kMaxSide << " pixels a side";
  throw std::runtime_error(text.str());
}

/// The json of Open3D (column by column) and that of Replica. False if it says nothing of the kind.
bool readCameraJson(const fs::path& path, FrameLayout& layout) {
  const std::string text = textOf(path);
  const auto one = [&text](const char* key) {
    const auto value = numbersBehind(text, key, 1);
    return value.empty() ? 0.0 : value[0];
  };
  const auto matrix = numbersBehind(text, "intrinsic_matrix", 9);
  if (matrix.size() == 9) {
    layout.intrinsics = Eigen::Vector4d(matrix[0], matrix[4], matrix[6], matrix[7]);
    layout.intended_size = checkedSize(path, one("width"), one("height"));
  } else if (one("fx") != 0.0 && one("fy") != 0.0) {
    layout.intrinsics = Eigen::Vector4d(one("fx"), one("fy"), one("cx"), one("cy"));
    layout.intended_size = checkedSize(path, one("w"), one("h"));
    if (one("scale") > 0.0) layout.units_per_metre = one("scale");
  } else {
    return false;
  }
  layout.intrinsics_source = path.filename().string();
  return true;
}

}  // namespace

Eigen::Vector4d readCameraMatrix(const std::string& path) {
  const FileBytes file("camera intrinsics", path);
  const std::vector<double> k = finiteNumbers(file, 16);
  if (k.size() != 9 && k.size() != 16) {
    file.fail("got " + std::string(k.size() > 16 ? "more than 16" : std::to_string(k.size())) +
              " numbers, wanted 9 (3x3) or 16 (4x4)");
  }
  const std::size_t step = k.size() == 9 ? 3 : 4;
  const auto at = [&](std::size_t row, std::size_t column) { return k[row * step + column]; };
  bool matrix = at(0, 0) != 0.0 && at(1, 1) != 0.0 && at(1, 0) == 0.0 && at(2, 0) == 0.0 && at(2, 1) == 0.0 &&
                at(2, 2) == 1.0;
  for (std::size_t n = 0; matrix && step == 4 && n < 4; ++n) {
    matrix = at(3, n) == (n == 3 ? 1.0 : 0.0) && (n == 3 || at(n, 3) == 0.0);
  }
  if (!matrix)
    file.fail("got no camera matrix, wanted fx 0 cx / 0 fy cy / 0 0 1 (or as 4x4) with focal lengths not 0");
  return {at(0, 0), at(1, 1), at(0, 2), at(1, 2)};
}

void findIntrinsics(const fs::path& folder, FrameLayout& layout) {
  const std::vector<std::string> matrices = {"camera-intrinsics.txt", "intrinsics.K.txt",
                                             "intrinsic_depth.txt",   "intrinsics_depth.txt",
                                             "intrinsics.txt",        "intrinsic.txt"};
  for (const fs::path& place : {folder, folder / "intrinsic"}) {
    for (const std::string& name : matrices) {
      const fs::path file = place / name;
      if (!fs::exists(file)) continue;
      layout.intrinsics = readCameraMatrix(file.string());
      layout.intrinsics_source = file.filename().string();
      return;
    }
    for (const char* name : {"camera_primesense.json", "camera_intrinsic.json", "intrinsic.json",
                             "intrinsics.json", "cam_params.json", "camera.json"}) {
      const fs::path file = place / name;
      if (fs::exists(file) && readCameraJson(file, layout)) return;
    }
  }
  // 3DMatch and Replica have one file for all sequences, a folder up.
  const fs::path above = fs::absolute(folder).lexically_normal().parent_path();
  if (fs::exists(above / "camera-intrinsics.txt")) {
    layout.intrinsics = readCameraMatrix((above / "camera-intrinsics.txt").string());
    layout.intrinsics_source = "../camera-intrinsics.txt";
  } else if (fs::exists(above / "cam_params.json")) {
    readCameraJson(above / "cam_params.json", layout);
  }
}

void useKnownIntrinsics(FrameLayout& layout, const Eigen::Vector4d& intrinsics, const Eigen::Array2i& size,
                        const std::string& source) {
  if (layout.intrinsics) return;
  layout.intrinsics = intrinsics;
  layout.intended_size = size;
  layout.intrinsics_source = "known of " + source;
}

void readBundleFusionInfo(const fs::path& path, FrameLayout& layout) {
  const std::string text = textOf(path);
  const auto k = numbersBehind(text, "m_calibrationDepthIntrinsic", 16);
  if (k.empty()) {
    throw std::runtime_error("camera intrinsics '" + path.string() +
                             "': got no m_calibrationDepthIntrinsic of 16 numbers");
  }
  layout.name = "BundleFusion";
  layout.intrinsics = Eigen::Vector4d(k[0], k[5], k[2], k[6]);
  layout.intrinsics_source = "info.txt";
  const auto shift = numbersBehind(text, "m_depthShift", 1), width = numbersBehind(text, "m_depthWidth", 1),
             height = numbersBehind(text, "m_depthHeight", 1);
  if (!shift.empty() && shift[0] > 0.0) layout.units_per_metre = shift[0];
  if (!width.empty() && !height.empty()) layout.intended_size = checkedSize(path, width[0], height[0]);
}

Eigen::Vector4d tumIntrinsics(const std::string& name, std::string* camera) {
  const std::pair<const char*, Eigen::Vector4d> kCameras[] = {
      // of the data set's calibration page
      {"freiburg1", {517.3, 516.5, 318.6, 255.3}}, {"freiburg2", {520.9, 521.0, 325.1, 249.7}},
      {"freiburg3", {535.4, 539.2, 320.1, 247.6}}, {"fr1", {517.3, 516.5, 318.6, 255.3}},
      {"fr2", {520.9, 521.0, 325.1, 249.7}},       {"fr3", {535.4, 539.2, 320.1, 247.6}}};
  for (const auto& [key, values] : kCameras) {
    if (name.find(key) == std::string::npos) continue;
    *camera = std::string("TUM ") + key;
    return values;
  }
  return Eigen::Vector4d::Zero();
}

}  // namespace ttsdf

#include "frame_layouts.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <regex>
#include <sstream>
#include <stdexcept>

#include "trajectory_file.h"
#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

namespace fs = std::filesystem;

namespace {

struct NumberedFile {
  int number;
  std::string path;
};

/// Files of a folder whose names match, by the number in the first group.
std::vector<NumberedFile> numbered(const fs::path& folder, const std::regex& pattern) {
  std::vector<NumberedFile> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::smatch match;
    if (std::regex_match(name, match, pattern) && match[1].length() <= 9) {
      files.push_back({std::stoi(match[1]), entry->path().string()});
    }
    if (error) break;
  }
  std::sort(files.begin(), files.end(), [](const NumberedFile& a, const NumberedFile& b) {
    return a.number != b.number ? a.number < b.number : a.path < b.path;
  });
  return files;
}

std::vector<NumberedFile> depthImages(const fs::path& folder) {
  static const std::regex kName(R"(\D*(\d+)(?:\D.*)?\.(?:png|pgm))");
  return numbered(folder, kName);
}

fs::path firstWithEnding(const fs::path& folder, const std::vector<std::string>& endings) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    for (const std::string& ending : endings) {
      if (name.size() >= ending.size() &&
          name.compare(name.size() - ending.size(), ending.size(), ending) == 0) {
        found.push_back(entry->path());
      }
    }
    if (error) break;
  }
  std::sort(found.begin(), found.end());
  return found.empty() ? fs::path() : found.front();
}

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
    layout.intended_size = Eigen::Array2i(static_cast<int>(one("width")), static_cast<int>(one("height")));
  } else if (one("fx") != 0.0 && one("fy") != 0.0) {
    layout.intrinsics = Eigen::Vector4d(one("fx"), one("fy"), one("cx"), one("cy"));
    layout.intended_size = Eigen::Array2i(static_cast<int>(one("w")), static_cast<int>(one("h")));
    if (one("scale") > 0.0) layout.units_per_metre = one("scale");
  } else {
    return false;
  }
  layout.intrinsics_source = path.filename().string();
  return true;
}

/// Looks for a file of intrinsics.
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

void known(FrameLayout& layout, const Eigen::Vector4d& intrinsics, const Eigen::Array2i& size,
           const std::string& source) {
  if (layout.intrinsics) return;
  layout.intrinsics = intrinsics;
  layout.intended_size = size;
  layout.intrinsics_source = "known of " + source;
}

/// BundleFusion's info.txt: `m_calibrationDepthIntrinsic = 16 numbers`, `m_depthShift = 1000`.
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
  if (!width.empty() && !height.empty()) {
    layout.intended_size = Eigen::Array2i(static_cast<int>(width[0]), static_cast<int>(height[0]));
  }
}

/// frame-NNNNNN.depth.png beside frame-NNNNNN.pose.txt.
bool tryFrameFiles(const fs::path& folder, FrameLayout& layout) {
  static const std::regex kName(R"(frame-(\d+)\.depth\.(?:png|pgm))");
  const auto images = numbered(folder, kName);
  if (images.empty()) return false;
  layout.name = "7-Scenes / 3DMatch";
  layout.images = images.size();
  for (const NumberedFile& image : images) {
    const fs::path path = image.path;
    const std::string name = path.filename().string();
    const fs::path pose = path.parent_path() / (name.substr(0, name.find('.')) + ".pose.txt");
    if (fs::exists(pose))
      layout.frames.push_back({image.number, image.path, pose.string(), 0.0, std::nullopt});
  }
  if (fs::exists(folder / "info.txt")) {
    readBundleFusionInfo(folder / "info.txt", layout);
  } else {
    findIntrinsics(folder, layout);
  }
  return true;
}

/// depth/N.png beside pose/N.txt.
bool tryScanNet(const fs::path& folder, FrameLayout& layout) {
  if (!fs::is_directory(folder / "depth") || !fs::is_directory(folder / "pose")) return false;
  layout.name = "ScanNet";
  const auto images = depthImages(folder / "depth");
  layout.images = images.size();
  for (const NumberedFile& image : images) {
    const fs::path pose = folder / "pose" / (fs::path(image.path).stem().string() + ".txt");
    if (fs::exists(pose))
      layout.frames.push_back({image.number, image.path, pose.string(), 0.0, std::nullopt});
  }
  findIntrinsics(folder, layout);
  return true;
}

/// The number of the image that the first pose belongs to. One image per pose: they are in order, whatever
/// their names. Otherwise files are missing, or poses, and only numbers from 0 or 1 on tell which.
int numberOfFirstPose(const fs::path& folder, const std::vector<NumberedFile>& images, const PoseList& list) {
  const int low = images.front().number, high = images.back().number;
  const int last = list.last - list.first;  // counted from 0
  if (low == 0 && high <= last) return 0;
  if (low >= 1 && high == last + 1) return 1;
  throw std::runtime_error(
      "frame folder '" + folder.string() + "': got " + std::to_string(images.size()) +
      " images with numbers from " + std::to_string(low) + " to " + std::to_string(high) + " for " +
      std::to_string(list.count) +
      " poses, wanted as many images as poses, or numbers that tell which is the first pose's: from 0 "
      "on, or from 1 up to the number of poses");
}

void addByNumber(const fs::path& folder, const std::vector<NumberedFile>& images, const PoseList& list,
                 FrameLayout& layout) {
  layout.images = images.size();
  if (images.empty()) return;
  const bool in_order =
      images.size() == list.count && static_cast<std::size_t>(list.last - list.first) + 1 == list.count;
  const int zero = in_order ? 0 : numberOfFirstPose(folder, images, list);
  const int first = in_order || list.first == 1 ? list.first : 0;
  for (std::size_t n = 0; n < images.size(); ++n) {
    const int place = in_order ? static_cast<int>(n) : images[n].number - zero;
    const auto pose = list.poses.find(first + place);
    if (pose == list.poses.end()) continue;
    layout.frames.push_back({place, images[n].path, "", 0.0, pose->second});
  }
}

/// results/depthNNNNNN.png and traj.txt, cam_params.json above.
bool tryReplica(const fs::path& folder, const FrameFolderOptions& options, FrameLayout& layout) {
  if (!fs::exists(folder / "traj.txt")) return false;
  static const std::regex kName(R"(depth(\d+)\.(?:png|pgm))");
  const auto images = numbered(folder / "results", kName);
  if (images.empty()) return false;
  layout.name = "Replica";
  layout.units_per_metre = 6553.5;
  findIntrinsics(folder, layout);
  known(layout, {600.0, 600.0, 599.5, 339.5}, {1200, 680}, "Replica");
  addByNumber(folder, images, readPoseLines((folder / "traj.txt").string(), options), layout);
  return true;
}

/// Stamps and names of a list `stamp file [stamp file]`; the pair whose name lies in depth/.
std::vector<std::pair<double, std::string>> readImageList(const fs::path& path) {
  const FileBytes file("list of images", path.string());
  WordCursor cursor = file.text();
  std::vector<std::pair<double, std::string>> images;
  while (!cursor.atEnd()) {
    const std::size_t number = cursor.lineNumber();
    std::string_view line = cursor.line();
    line = line.substr(0, line.find('#'));
    WordCursor words(line.data(), line.data() + line.size());
    std::vector<std::string_view> row;
    for (auto word = words.next(); !word.empty(); word = words.next()) row.push_back(word);
    if (row.empty()) continue;
    bool found = false;
    for (std::size_t n = 0; n + 1 < row.size() && !found; n += 2) {
      double stamp = 0.0;
      const std::string name(row[n + 1]);
      found = parseNumber(row[n], &stamp) && (row.size() == 2 || name.find("depth") != std::string::npos);
      if (found) images.emplace_back(stamp, name);
    }
    if (!found)
      file.fail("got '" + shown(line) + "' in line " + std::to_string(number) + ", wanted: stamp file");
  }
  return images;
}

/// The longest gap between poses over which one is interpolated [s].
double longestGap(const std::vector<StampedPose>& poses) {
  std::vector<double> gaps;
  for (std::size_t n = 1; n < poses.size(); ++n) gaps.push_back(poses[n].stamp - poses[n - 1].stamp);
  if (gaps.empty()) return 0.0;
  std::nth_element(gaps.begin(), gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2), gaps.end());
  constexpr double kMissing = 5.0, kAtLeast = 0.05;
  return std::max(kAtLeast, kMissing * gaps[gaps.size() / 2]);
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

/// depth.txt and groundtruth.txt, stamps of their own.
bool tryTum(const fs::path& folder, const FrameFolderOptions& options, FrameLayout& layout) {
  const fs::path list = folder / "depth.txt", truth = folder / "groundtruth.txt";
  if (!fs::exists(list) || !fs::exists(truth)) return false;
  layout.name = "TUM RGB-D";
  layout.units_per_metre = 5000.0;
  const auto images = readImageList(list);
  const auto poses = readStampedPoses(truth.string(), options);
  layout.quaternions = true;
  const double gap = longestGap(poses);
  layout.images = images.size();
  for (std::size_t n = 0; n < images.size(); ++n) {
    const auto pose = poseAt(poses, images[n].first + options.stamp_shift, gap);
    if (!pose) continue;
    layout.frames.push_back(
        {static_cast<int>(n), (folder / images[n].second).string(), "", images[n].first, *pose});
  }
  if (layout.frames.empty() && !images.empty()) {
    std::ostringstream text;
    text << std::fixed << std::setprecision(3) << "frame folder '" << folder.string()
         << "': got images with stamps from " << images.front().first << " to " << images.back().first
         << " s and poses from " << poses.front().stamp << " to " << poses.back().stamp
         << " s, wanted stamps of one clock, in seconds (--stamp-shift is added to the images')";
    throw std::runtime_error(text.str());
  }
  findIntrinsics(folder, layout);
  std::string camera;
  const Eigen::Vector4d of_name = tumIntrinsics(fs::absolute(folder).lexically_normal().string(), &camera);
  if (!camera.empty()) known(layout, of_name, {640, 480}, camera);
  return true;
}

/// depth/ and one file of poses by frame: *.log (Redwood, Open3D), *.freiburg (ICL-NUIM), pose.txt
/// (slambook).
bool tryOneTrajectory(const fs::path& folder, const FrameFolderOptions& options, FrameLayout& layout) {
  const auto images = depthImages(fs::is_directory(folder / "depth") ? folder / "depth" : folder / "image");
  if (images.empty()) return false;
  fs::path file = firstWithEnding(folder, {"trajectory.log", ".log"});
  if (file.empty()) file = firstWithEnding(folder / "scene", {"trajectory.log", ".log"});
  if (!file.empty()) {
    layout.name = "Redwood / Open3D";
    findIntrinsics(folder, layout);
    known(layout, {525.0, 525.0, 319.5, 239.5}, {640, 480}, "Redwood's PrimeSense");
    addByNumber(folder, images, readPoseLog(file.string()), layout);
    return true;
  }
  file = firstWithEnding(folder, {".gt.freiburg", ".freiburg"});
  if (!file.empty()) {
    layout.name = "ICL-NUIM";
    layout.units_per_metre = 5000.0;
    findIntrinsics(folder, layout);
    known(layout, {481.2, -480.0, 319.5, 239.5}, {640, 480}, "ICL-NUIM");
    layout.quaternions = true;
    std::map<int, Eigen::Isometry3d> poses;
    for (const StampedPose& pose : readStampedPoses(file.string(), options))
      poses[static_cast<int>(std::lround(pose.stamp))] = pose.T;
    layout.images = images.size();
    for (std::size_t n = 0; n < images.size(); ++n) {
      const auto pose = poses.find(images[n].number);
      if (pose != poses.end())
        layout.frames.push_back({static_cast<int>(n), images[n].path, "", 0.0, pose->second});
    }
    return true;
  }
  file = folder / "pose.txt";
  if (!fs::exists(file)) file = folder / "poses.txt";
  if (!fs::exists(file)) file = folder / "traj.txt";
  if (!fs::exists(file)) return false;
  layout.name = "depth images with a list of poses";
  findIntrinsics(folder, layout);
  const PoseList list = readPoseLines(file.string(), options);
  layout.quaternions = list.quaternions;
  addByNumber(folder, images, list, layout);
  return true;
}

/// Clouds in the images' place: frame-NNNNNN.pcd beside its pose, or a folder of them with poses as the other
/// layouts have them.
bool tryClouds(const fs::path& folder, const FrameFolderOptions& options, FrameLayout& layout) {
  static const std::regex kFrame(R"(frame-(\d+)(?:\.cloud)?\.(?:pcd|ply|bin|xyz))");
  static const std::regex kCloud(R"(\D*(\d+)\.(?:pcd|ply|bin|xyz))");
  layout.clouds = true;
  layout.name = "clouds with poses";
  auto clouds = numbered(folder, kFrame);
  layout.images = clouds.size();
  for (const NumberedFile& cloud : clouds) {
    const std::string name = fs::path(cloud.path).filename().string();
    const fs::path pose = folder / (name.substr(0, name.find('.')) + ".pose.txt");
    if (fs::exists(pose))
      layout.frames.push_back({cloud.number, cloud.path, pose.string(), 0.0, std::nullopt});
  }
  if (!clouds.empty()) return true;
  for (const char* place : {"cloud", "clouds", "pcd", "velodyne"}) {
    clouds = numbered(folder / place, kCloud);
    if (!clouds.empty()) break;
  }
  if (clouds.empty()) return false;
  layout.images = clouds.size();
  if (fs::is_directory(folder / "pose")) {
    for (const NumberedFile& cloud : clouds) {
      const fs::path pose = folder / "pose" / (fs::path(cloud.path).stem().string() + ".txt");
      if (fs::exists(pose))
        layout.frames.push_back({cloud.number, cloud.path, pose.string(), 0.0, std::nullopt});
    }
    return true;
  }
  const fs::path log = firstWithEnding(folder, {"trajectory.log", ".log"});
  if (!log.empty()) {
    addByNumber(folder, clouds, readPoseLog(log.string()), layout);
    return true;
  }
  for (const char* name : {"poses.txt", "pose.txt", "traj.txt"}) {
    if (!fs::exists(folder / name)) continue;
    addByNumber(folder, clouds, readPoseLines((folder / name).string(), options), layout);
    return true;
  }
  return true;  // clouds without poses: said where the others are
}

std::string subfolders(const fs::path& folder) {
  std::string text;
  for (const auto& entry : fs::directory_iterator(folder)) {
    FrameLayout ignored;
    if (entry.is_directory() && tryFrameFiles(entry.path(), ignored)) {
      text += (text.empty() ? "" : ", ") + entry.path().filename().string();
    }
  }
  return text;
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

FrameLayout findLayout(const std::string& path, const FrameFolderOptions& options) {
  const fs::path folder = path;
  if (!fs::is_directory(folder)) throw std::runtime_error("frame folder '" + path + "': no such folder");
  FrameLayout layout;
  if (tryFrameFiles(folder, layout) || tryReplica(folder, options, layout) ||
      tryTum(folder, options, layout) || tryOneTrajectory(folder, options, layout) ||
      tryScanNet(folder, layout)) {
    return layout;
  }
  layout = FrameLayout();
  if (tryClouds(folder, options, layout)) return layout;
  const std::string parts = subfolders(folder);
  throw std::runtime_error(
      "frame folder '" + path + "': got no frames of a known layout" +
      (parts.empty()
           ? std::string(
                 ", wanted frame-NNNNNN.depth.png with .pose.txt (7-Scenes, 3DMatch, BundleFusion), "
                 "depth/ with pose/ (ScanNet), depth.txt with groundtruth.txt (TUM), depth/ with a .log "
                 "(Redwood) or .freiburg (ICL-NUIM), results/ with traj.txt (Replica), or clouds with poses")
           : ", wanted one of its folders: " + parts));
}

}  // namespace ttsdf

#include "frame_layouts.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <regex>
#include <sstream>
#include <stdexcept>

#include "intrinsics_files.h"
#include "trajectory_file.h"
#include "ttsdf_localization/geometry/median.h"
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
  useKnownIntrinsics(layout, {600.0, 600.0, 599.5, 339.5}, {1200, 680}, "Replica");
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
  constexpr double kMissing = 5.0, kAtLeast = 0.05;
  return std::max(kAtLeast, kMissing * upperMedian(gaps));
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
  if (!camera.empty()) useKnownIntrinsics(layout, of_name, {640, 480}, camera);
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
    useKnownIntrinsics(layout, {525.0, 525.0, 319.5, 239.5}, {640, 480}, "Redwood's PrimeSense");
    addByNumber(folder, images, readPoseLog(file.string()), layout);
    return true;
  }
  file = firstWithEnding(folder, {".gt.freiburg", ".freiburg"});
  if (!file.empty()) {
    layout.name = "ICL-NUIM";
    layout.units_per_metre = 5000.0;
    findIntrinsics(folder, layout);
    useKnownIntrinsics(layout, {481.2, -480.0, 319.5, 239.5}, {640, 480}, "ICL-NUIM");
    layout.quaternions = true;
    std::map<int, Eigen::Isometry3d> poses;
    for (const StampedPose& pose : readStampedPoses(file.string(), options)) {
      // Beyond that no image has a number.
      if (std::abs(pose.stamp) < 1e9) poses[static_cast<int>(std::lround(pose.stamp))] = pose.T;
    }
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

#include "ttsdf_localization/frames/frame_folder.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

namespace fs = std::filesystem;

namespace {

/// All numbers of a text file. Throws naming the file unless there are exactly `wanted`, all finite.
std::vector<double> readNumbers(const std::string& what, const std::string& path, std::size_t wanted) {
  std::ifstream in(path);
  if (!in || fs::is_directory(path)) throw std::runtime_error(what + " '" + path + "': cannot be opened");
  std::vector<double> numbers;
  std::string word;
  while (in >> word) {
    std::size_t used = 0;
    double number = std::numeric_limits<double>::quiet_NaN();
    try {
      number = std::stod(word, &used);  // istream does not read "nan", which must be named in the error
    } catch (const std::logic_error&) {
    }
    if (used != word.size() || !std::isfinite(number)) {
      throw std::runtime_error(what + " '" + path + "': got '" + word.substr(0, 40) +
                               "', wanted a finite number");
    }
    numbers.push_back(number);
    if (numbers.size() > wanted) break;
  }
  if (numbers.size() != wanted) {
    throw std::runtime_error(what + " '" + path + "': got " + (numbers.size() > wanted ? "more than " : "") +
                             std::to_string(std::min(numbers.size(), wanted)) + " numbers, wanted " +
                             std::to_string(wanted));
  }
  return numbers;
}

/// Index of "frame-NNNNNN.depth.png" (or .pgm); -1 for another name.
int frameIndex(const std::string& name) {
  const std::string prefix = "frame-";
  const std::size_t dot = name.find('.');
  if (name.compare(0, prefix.size(), prefix) != 0 || dot == std::string::npos) return -1;
  const std::string digits = name.substr(prefix.size(), dot - prefix.size()), ending = name.substr(dot);
  if (ending != ".depth.png" && ending != ".depth.pgm") return -1;
  if (digits.empty() || digits.size() > 9 || digits.find_first_not_of("0123456789") != std::string::npos)
    return -1;
  return std::stoi(digits);
}

struct FolderContent {
  std::vector<FrameEntry> frames;  ///< with a pose, rising index
  std::size_t images = 0;          ///< with or without a pose
};

FolderContent listFrames(const std::string& path) {
  FolderContent content;
  for (const auto& entry : fs::directory_iterator(path)) {
    const std::string name = entry.path().filename().string();
    const int index = frameIndex(name);
    if (index < 0) continue;
    ++content.images;
    const fs::path pose = entry.path().parent_path() / (name.substr(0, name.find('.')) + ".pose.txt");
    if (fs::exists(pose)) content.frames.push_back({index, entry.path().string(), pose.string()});
  }
  std::sort(content.frames.begin(), content.frames.end(), [](const FrameEntry& a, const FrameEntry& b) {
    return a.index != b.index ? a.index < b.index : a.depth_path < b.depth_path;
  });
  return content;
}

CameraIntrinsics readIntrinsics(const std::string& folder) {
  for (const char* name : {"camera-intrinsics.txt", "intrinsics.K.txt"}) {
    const std::string path = (fs::path(folder) / name).string();
    if (!fs::exists(path)) continue;
    const std::vector<double> k = readNumbers("camera intrinsics", path, 9);
    if (k[0] == 0.0 || k[4] == 0.0 || k[8] != 1.0 || k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0) {
      throw std::runtime_error(
          "camera intrinsics '" + path +
          "': got no camera matrix, wanted fx 0 cx / 0 fy cy / 0 0 1 with focal lengths not 0");
    }
    CameraIntrinsics intrinsics;
    intrinsics.fx = k[0], intrinsics.fy = k[4], intrinsics.cx = k[2], intrinsics.cy = k[5];
    return intrinsics;
  }
  throw std::runtime_error("frame folder '" + folder + "': got no camera-intrinsics.txt or intrinsics.K.txt");
}

}  // namespace

Eigen::Isometry3d readPose(const std::string& path) {
  const std::vector<double> numbers = readNumbers("pose", path, 16);
  const Eigen::Matrix4d matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
  try {
    return orthonormalized(matrix);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error("pose '" + path + "': " + error.what());
  }
}

void writePose(const std::string& path, const Eigen::Isometry3d& T) {
  std::ofstream out(path);
  out << std::setprecision(std::numeric_limits<double>::max_digits10);
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) out << T.matrix()(row, column) << (column < 3 ? ' ' : '\n');
  }
  out.close();
  if (!out) throw std::runtime_error("pose '" + path + "': cannot be written");
}

FrameFolder::FrameFolder(const std::string& path, double units_per_metre)
    : units_per_metre_(units_per_metre) {
  if (!fs::is_directory(path)) throw std::runtime_error("frame folder '" + path + "': no such folder");
  FolderContent content = listFrames(path);
  if (content.images == 0) {
    throw std::runtime_error("frame folder '" + path + "': got no frame-NNNNNN.depth.png");
  }
  if (content.frames.empty()) {
    throw std::runtime_error("frame folder '" + path + "': got " + std::to_string(content.images) +
                             " depth images and none with a frame-NNNNNN.pose.txt");
  }
  intrinsics_ = readIntrinsics(path);
  frames_ = std::move(content.frames);
  std::string first_error;
  for (const FrameEntry& frame : frames_) {
    try {
      const DepthImage image = depth(frame);
      intrinsics_.width = image.width, intrinsics_.height = image.height;
      return;
    } catch (const std::runtime_error& error) {
      if (first_error.empty()) first_error = error.what();
    }
  }
  throw std::runtime_error("frame folder '" + path +
                           "': no depth image can be read; the first: " + first_error);
}

std::vector<FrameEntry> FrameFolder::select(int every, int offset) const {
  if (every < 1 || offset < 0 || offset >= every) {
    throw std::invalid_argument("frame selection: got every " + std::to_string(every) + ", offset " +
                                std::to_string(offset) +
                                ", wanted every >= 1 and offset from 0 to every - 1");
  }
  std::vector<FrameEntry> selected;
  std::copy_if(frames_.begin(), frames_.end(), std::back_inserter(selected),
               [=](const FrameEntry& frame) { return frame.index % every == offset; });
  return selected;
}

}  // namespace ttsdf

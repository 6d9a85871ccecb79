#include "ttsdf_localization/frames/frame_folder.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>

#include "frame_corrections.h"
#include "frame_layouts.h"
#include "ttsdf_localization/geometry/se3.h"
#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

namespace fs = std::filesystem;

namespace {

void checkIntrinsics(const CameraIntrinsics& k, const std::string& source) {
  constexpr double kWidest = 0.1, kNarrowest = 20.0, kOutside = 0.5;  // in the image's sizes
  std::ostringstream got;
  got << "camera intrinsics (" << source << "): got fx " << k.fx << ", fy " << k.fy << ", cx " << k.cx
      << ", cy " << k.cy << " for images of " << k.width << " x " << k.height << ": ";
  const auto plausible = [](double focal, int size) {
    return std::abs(focal) >= kWidest * size && std::abs(focal) <= kNarrowest * size;
  };
  if (!plausible(k.fx, k.width) || !plausible(k.fy, k.height)) {
    got << "no depth camera sees that much or that little, wanted a focal length of about the image's width";
    throw std::runtime_error(got.str());
  }
  const auto inside = [](double centre, int size) {
    return centre >= -kOutside * size && centre <= (1.0 + kOutside) * size;
  };
  if (!inside(k.cx, k.width) || !inside(k.cy, k.height)) {
    const double factor = k.width / (2.0 * k.cx);
    got << "the principal point is far outside of the image (intrinsics of another camera or image size?)";
    if (factor > 0.01 && factor < 100.0) {
      got << "; of an image of about " << std::lround(2.0 * k.cx) << " x " << std::lround(2.0 * k.cy)
          << " pixels, they would be --intrinsics " << k.fx * factor << ',' << k.fy * factor << ','
          << k.cx * factor << ',' << k.cy * factor << " here";
    }
    throw std::runtime_error(got.str());
  }
}

}  // namespace

Eigen::Isometry3d readPose(const std::string& path) {
  const FileBytes file("pose", path);
  std::vector<double> numbers = finiteNumbers(file, 16);
  const std::size_t count = numbers.size();
  if (count == 12) numbers.insert(numbers.end(), {0.0, 0.0, 0.0, 1.0});
  if (numbers.size() != 16) {
    file.fail("got " + (count > 16 ? std::string("more than 16") : std::to_string(count)) +
              " numbers, wanted 16 (4x4) or 12 (3x4)");
  }
  const Eigen::Matrix4d matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
  const bool by_columns = matrix.col(3) == Eigen::Vector4d::UnitW() && !matrix.row(3).head<3>().isZero();
  if (by_columns)
    file.fail("is written column by column, wanted row by row: the translation on the right, 0 0 0 1 below");
  try {
    return orthonormalized(matrix);
  } catch (const std::invalid_argument& error) {
    file.fail(error.what());
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
    : FrameFolder(path, [units_per_metre] {
        FrameFolderOptions options;
        options.units_per_metre = units_per_metre;
        return options;
      }()) {}

FrameFolder::FrameFolder(const std::string& path, const FrameFolderOptions& options) : options_(options) {
  FrameLayout layout = findLayout(path, options);
  if (layout.images == 0) throw std::runtime_error("frame folder '" + path + "': got no depth image");
  if (layout.frames.empty()) {
    throw std::runtime_error("frame folder '" + path + "': got " + std::to_string(layout.images) +
                             (layout.clouds ? " clouds" : " depth images") +
                             " and none with a pose (layout " + layout.name +
                             (layout.name == "ScanNet" ? ", wanted pose/N.txt)"
                                                       : ", wanted frame-NNNNNN.pose.txt or a trajectory)"));
  }
  layout_ = layout.name;
  quaternions_ = layout.quaternions;
  if (layout.clouds) {
    clouds_ = true;
    frames_ = std::move(layout.frames);
    description_ = "layout " + layout_ + ", " + std::to_string(frames_.size()) + " of " +
                   std::to_string(layout.images) + " clouds with a pose";
    return;
  }
  if (options.intrinsics) {
    layout.intrinsics = options.intrinsics;
    layout.intrinsics_source = "as given";
    layout.intended_size.setZero();
  }
  if (!layout.intrinsics) {
    throw std::runtime_error(
        "frame folder '" + path +
        "': got no camera-intrinsics.txt, intrinsics.K.txt, ...; wanted one, or --intrinsics FX,FY,CX,CY "
        "(7-Scenes: 585,585,320,240)");
  }
  intrinsics_.fx = (*layout.intrinsics)[0], intrinsics_.fy = (*layout.intrinsics)[1];
  intrinsics_.cx = (*layout.intrinsics)[2], intrinsics_.cy = (*layout.intrinsics)[3];
  units_per_metre_ = options.units_per_metre > 0.0 ? options.units_per_metre : layout.units_per_metre;
  frames_ = std::move(layout.frames);
  settleSize(path, layout.intended_size);
  checkIntrinsics(intrinsics_, layout.intrinsics_source);
  std::ostringstream text;
  text << "layout " << layout.name << ", " << frames_.size() << " of " << layout.images
       << " images with a pose, " << intrinsics_.width << " x " << intrinsics_.height << " pixels, fx "
       << intrinsics_.fx << " fy " << intrinsics_.fy << " cx " << intrinsics_.cx << " cy " << intrinsics_.cy
       << " (" << layout.intrinsics_source << "), " << units_per_metre_ << " depth units per metre"
       << description_;
  description_ = text.str();
}

void FrameFolder::settleSize(const std::string& path, const Eigen::Array2i& intended) {
  std::map<std::pair<int, int>, std::size_t> sizes;
  for (const FrameEntry& frame : frames_) {
    const Eigen::Array2i size = depthImageSize(frame.depth_path);
    if ((size > 0).all()) ++sizes[{size[0], size[1]}];
  }
  if (sizes.empty()) {
    std::string first_error = "none";
    try {
      depth(frames_.front());
    } catch (const std::runtime_error& error) {
      first_error = error.what();
    }
    throw std::runtime_error("frame folder '" + path +
                             "': no depth image can be read; the first: " + first_error);
  }
  const auto most = std::max_element(sizes.begin(), sizes.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  intrinsics_.width = most->first.first, intrinsics_.height = most->first.second;
  if (sizes.size() > 1) {
    description_ = ", " + std::to_string(frames_.size() - most->second) + " images of other sizes";
  }
  // Intrinsics that say which size they belong to are scaled to another one of the same shape.
  if ((intended <= 0).any() || (intended[0] == intrinsics_.width && intended[1] == intrinsics_.height))
    return;
  const double fx = static_cast<double>(intrinsics_.width) / intended[0];
  const double fy = static_cast<double>(intrinsics_.height) / intended[1];
  constexpr double kSameShape = 0.02;
  if (std::abs(fx / fy - 1.0) > kSameShape) {
    throw std::runtime_error(
        "frame folder '" + path + "': got images of " + std::to_string(intrinsics_.width) + " x " +
        std::to_string(intrinsics_.height) + " and intrinsics for " + std::to_string(intended[0]) + " x " +
        std::to_string(intended[1]) + ", wanted --intrinsics FX,FY,CX,CY of these images");
  }
  intrinsics_.fx *= fx, intrinsics_.cx = (intrinsics_.cx + 0.5) * fx - 0.5;
  intrinsics_.fy *= fy, intrinsics_.cy = (intrinsics_.cy + 0.5) * fy - 0.5;
  description_ +=
      ", intrinsics scaled from " + std::to_string(intended[0]) + " x " + std::to_string(intended[1]);
}

Eigen::Isometry3d FrameFolder::pose(const FrameEntry& frame) const {
  Eigen::Isometry3d T = frame.pose ? *frame.pose : readPose(frame.pose_path);
  return corrected(T, options_);
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

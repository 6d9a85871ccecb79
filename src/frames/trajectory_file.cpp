#include "trajectory_file.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "ttsdf_localization/geometry/se3.h"
#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

namespace {

[[noreturn]] void failPoses(const std::string& path, const std::string& what) {
  throw std::runtime_error("poses '" + path + "': " + what);
}

Eigen::Isometry3d fromQuaternion(const double* v, const FrameFolderOptions& options, const std::string& path,
                                 std::size_t row) {
  const Eigen::Quaterniond q = options.quaternions_w_first ? Eigen::Quaterniond(v[3], v[4], v[5], v[6])
                                                           : Eigen::Quaterniond(v[6], v[3], v[4], v[5]);
  if (!(std::abs(q.norm() - 1.0) < 0.05)) {
    failPoses(path, "got a quaternion of length " + std::to_string(q.norm()) + " in row " +
                        std::to_string(row + 1) + ", wanted 1");
  }
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(v[0], v[1], v[2]);
  T.linear() = q.normalized().toRotationMatrix();
  return T;
}

/// Nothing for a matrix that is no pose: data sets mark lost frames so.
std::optional<Eigen::Isometry3d> fromMatrix(const double* numbers) {
  try {
    return orthonormalized(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers));
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

}  // namespace

std::vector<std::vector<double>> readRows(const std::string& path, bool strict) {
  const FileBytes file("poses", path);
  WordCursor cursor = file.text();
  std::vector<std::vector<double>> rows;
  while (!cursor.atEnd()) {
    const std::size_t number = cursor.lineNumber();
    std::string line(cursor.line());
    line = line.substr(0, line.find('#'));
    std::replace(line.begin(), line.end(), ',', ' ');
    WordCursor words(line.data(), line.data() + line.size());
    std::vector<double> row;
    bool good = true;
    for (std::string_view word = words.next(); good && !word.empty(); word = words.next()) {
      double value = 0.0;
      good = parseNumber(word, &value);
      if (good) row.push_back(value);
      if (!good && strict)
        failPoses(path, "got '" + shown(word) + "' in line " + std::to_string(number) + ", wanted numbers");
    }
    if (good && !row.empty()) rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<StampedPose> readStampedPoses(const std::string& path, const FrameFolderOptions& options) {
  std::vector<StampedPose> poses;
  const auto rows = readRows(path);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (rows[r].size() != 8) {
      failPoses(path, "got " + std::to_string(rows[r].size()) + " numbers in row " + std::to_string(r + 1) +
                          ", wanted: stamp tx ty tz qx qy qz qw");
    }
    const bool finite =
        std::all_of(rows[r].begin(), rows[r].end(), [](double x) { return std::isfinite(x); });
    if (finite) poses.push_back({rows[r][0], fromQuaternion(rows[r].data() + 1, options, path, r)});
  }
  if (poses.empty()) failPoses(path, "got no pose");
  std::stable_sort(poses.begin(), poses.end(),
                   [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
  return poses;
}

PoseList readPoseLog(const std::string& path) {
  const auto rows = readRows(path);
  if (rows.empty() || rows.size() % 5 != 0) {
    failPoses(path, "got " + std::to_string(rows.size()) + " lines, wanted 5 per pose");
  }
  PoseList list;
  for (std::size_t r = 0; r < rows.size(); r += 5) {
    double numbers[16];
    for (std::size_t k = 0; k < 4; ++k) {
      if (rows[r + 1 + k].size() != 4)
        failPoses(path, "got no 4x4 matrix in row " + std::to_string(r + 2 + k));
      std::copy(rows[r + 1 + k].begin(), rows[r + 1 + k].end(), numbers + 4 * k);
    }
    if (!(std::abs(rows[r][0]) < 1e9))
      failPoses(path,
                "got the frame number " + std::to_string(rows[r][0]) + " in row " + std::to_string(r + 1));
    const int number = static_cast<int>(rows[r][0]);
    list.first = list.count == 0 ? number : std::min(list.first, number);
    list.last = list.count == 0 ? number : std::max(list.last, number);
    ++list.count;
    if (const auto T = fromMatrix(numbers)) list.poses[number] = *T;
  }
  return list;
}

PoseList readPoseLines(const std::string& path, const FrameFolderOptions& options) {
  auto rows = readRows(path);
  PoseList list;
  list.count = rows.size();
  list.last = static_cast<int>(rows.size()) - 1;
  auto& poses = list.poses;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (rows[r].size() == 7) {
      list.quaternions = true;
      poses[static_cast<int>(r)] = fromQuaternion(rows[r].data(), options, path, r);
    } else if (rows[r].size() == 12) {  // KITTI: without the last row
      rows[r].insert(rows[r].end(), {0.0, 0.0, 0.0, 1.0});
      if (const auto T = fromMatrix(rows[r].data())) poses[static_cast<int>(r)] = *T;
    } else if (rows[r].size() == 16) {
      if (const auto T = fromMatrix(rows[r].data())) poses[static_cast<int>(r)] = *T;
    } else {
      failPoses(path, "got " + std::to_string(rows[r].size()) + " numbers in row " + std::to_string(r + 1) +
                          ", wanted 16 (4x4), 12 (3x4) or 7 (tx ty tz qx qy qz qw)");
    }
  }
  return list;
}

std::optional<Eigen::Isometry3d> poseAt(const std::vector<StampedPose>& poses, double stamp, double gap) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), stamp,
                                      [](const StampedPose& p, double s) { return p.stamp < s; });
  if (after == poses.end()) return std::nullopt;
  if (after->stamp == stamp) return after->T;
  if (after == poses.begin()) return std::nullopt;
  const StampedPose &a = *(after - 1), &b = *after;
  if (b.stamp - a.stamp > gap) return std::nullopt;
  const double share = (stamp - a.stamp) / (b.stamp - a.stamp);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = (1.0 - share) * a.T.translation() + share * b.T.translation();
  T.linear() =
      Eigen::Quaterniond(a.T.linear()).slerp(share, Eigen::Quaterniond(b.T.linear())).toRotationMatrix();
  return T;
}

}  // namespace ttsdf

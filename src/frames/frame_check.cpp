#include "ttsdf_localization/frames/frame_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>

#include "frame_corrections.h"
#include "trajectory_file.h"
#include "ttsdf_localization/geometry/median.h"

namespace ttsdf {

namespace {

constexpr double kGood = 0.5, kNonsense = 0.3, kClearlyBetter = 0.3, kConvincing = 0.6;
constexpr double kNothingToAsk = 0.9, kLeftOver = 0.25;
// What is mirrored shows in little of a camera that hardly leaves its place, and nothing else explains it.
constexpr double kNothingToAskOfMirrors = 0.98;
constexpr std::size_t kLeastPoints = 200;

/// One reading of the folder.
struct Reading {
  std::string change, option;
  FrameFolderOptions folder;
  double depth_factor = 1.0, shift = 0.0;  // [s], besides the folder's own
  bool quaternions_turned = false;
  bool mirrored = false;  // as one of the usual mistakes
  CameraIntrinsics camera;
};

struct Frame {
  DepthImage image;
  Eigen::Isometry3d T_given;  // as the folder has it
  double stamp = 0.0;
};

/// What all readings are tried on.
struct Sample {
  std::map<std::size_t, Frame> frames;
  std::vector<StampedPose> trajectory;  // where the folder has stamps
};

struct Pair {
  std::size_t a, b;
};

/// The same four numbers in the other order than they were read in.
void turnQuaternion(Eigen::Isometry3d& T, bool read_w_first) {
  const Eigen::Quaterniond q(T.linear());
  T.linear() = (read_w_first ? Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y())
                             : Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()))
                   .toRotationMatrix();
}

std::optional<Eigen::Isometry3d> poseOf(const Sample& sample, const Frame& frame, const Reading& reading) {
  Eigen::Isometry3d T = frame.T_given;
  if (reading.shift != 0.0) {
    constexpr double kGap = 1.0;  // [s]; frames stand closer
    const auto shifted = poseAt(sample.trajectory, frame.stamp + reading.shift, kGap);
    if (!shifted) return std::nullopt;
    T = *shifted;
  }
  if (reading.quaternions_turned) turnQuaternion(T, reading.folder.quaternions_w_first);
  return corrected(T, reading.folder);
}

/// Points of frame a that frame b sees at the same place. Those hidden from b count for nothing.
void compare(const Sample& sample, const Frame& a, const Frame& b, const Reading& reading, double& agreeing,
             double& tested, std::size_t& total) {
  constexpr int kAcross = 24;
  constexpr double kTolerance = 0.04, kRelative = 0.02;  // [m] and per metre of depth
  const CameraIntrinsics& k = reading.camera;
  const auto T_map_a = poseOf(sample, a, reading), T_map_b = poseOf(sample, b, reading);
  if (!T_map_a || !T_map_b) return;
  const Eigen::Isometry3d T_b_a = T_map_b->inverse() * *T_map_a;
  const int step = std::max(1, a.image.width / kAcross);
  const double f = reading.depth_factor;
  double agree = 0.0, seen = 0.0, points = 0.0;
  for (int v = step / 2; v < a.image.height; v += step) {
    for (int u = step / 2; u < a.image.width; u += step) {
      const double z = f * a.image.at(u, v);
      if (!(z > 0.0)) continue;
      points += 1.0;
      const Eigen::Vector3d p = T_b_a * Eigen::Vector3d((u - k.cx) / k.fx * z, (v - k.cy) / k.fy * z, z);
      if (p.z() <= 0.0) continue;
      const double x = k.fx * p.x() / p.z() + k.cx, y = k.fy * p.y() / p.z() + k.cy;
      if (!(x >= 0.0 && y >= 0.0 && x <= b.image.width - 1.0 && y <= b.image.height - 1.0)) continue;
      const double d = f * b.image.at(static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y)));
      if (!(d > 0.0)) continue;
      seen += 1.0;
      const double tolerance = kTolerance + kRelative * std::max(d, p.z());
      if (std::abs(p.z() - d) <= tolerance) agree += 1.0;
    }
  }
  // A reading that turns the frames away from one another must not win by the few points that are left.
  constexpr double kLeastOverlap = 0.15;
  agreeing += agree;
  tested += std::max(seen, kLeastOverlap * points);
  total += static_cast<std::size_t>(points);
}

PairAgreement agreementOf(const Sample& sample, const std::vector<Pair>& pairs, const Reading& reading) {
  PairAgreement result;
  double agreeing = 0.0, tested = 0.0;
  for (const Pair& pair : pairs) {
    const Frame &a = sample.frames.at(pair.a), &b = sample.frames.at(pair.b);
    compare(sample, a, b, reading, agreeing, tested, result.points);
    compare(sample, b, a, reading, agreeing, tested, result.points);
  }
  result.share = tested > 0.0 ? agreeing / tested : 0.0;
  return result;
}

/// Left-handed poses, and those of which somebody turned an axis round in a half only. `add` takes a change,
/// the option and an edit of the reading.
template <class Add>
void addMirrors(const std::string& direction, const Add& add) {
  const auto both = [&](const std::string& change, const std::string& option, const auto& edit) {
    add("with " + change, "--mirror-poses " + option, [edit](Reading& r) {
      edit(r);
      r.mirrored = true;
    });
    add("with the poses inverted and " + change, "--poses " + direction + " --mirror-poses " + option,
        [edit](Reading& r) {
          edit(r);
          r.mirrored = true;
          r.folder.poses_world_to_camera = !r.folder.poses_world_to_camera;
        });
  };
  constexpr std::array<char, 3> kAxes = {'x', 'y', 'z'};
  for (const char axis : kAxes) {
    both("the poses taken for left-handed", {axis}, [axis](Reading& r) { r.folder.mirrored_axis = axis; });
  }
  for (const char axis : kAxes) {
    both("the poses' positions mirrored", std::string("positions-") + axis,
         [axis](Reading& r) { r.folder.mirrored_positions = axis; });
    for (const char of_camera : kAxes) {
      const std::string axes{axis, of_camera};
      both("the poses' rotations mirrored", "rotations-" + axes,
           [axes](Reading& r) { r.folder.mirrored_rotations = axes; });
    }
  }
}

std::vector<Reading> usualMistakes(const FrameFolder& folder, const FrameFolderOptions& given) {
  std::vector<Reading> readings;
  Reading as_given;
  as_given.folder = given;
  as_given.camera = folder.intrinsics();
  readings.push_back(as_given);
  const auto add = [&](const std::string& change, const std::string& option, const auto& edit) {
    Reading reading = as_given;
    reading.change = change;
    reading.option = option;
    edit(reading);
    readings.push_back(reading);
  };
  const std::string direction = given.poses_world_to_camera ? "camera-to-world" : "world-to-camera";
  const std::string axes = given.opengl_axes ? "opencv" : "opengl";
  add("with the poses inverted", "--poses " + direction,
      [](Reading& r) { r.folder.poses_world_to_camera = !r.folder.poses_world_to_camera; });
  add("with " + axes + " camera axes", "--camera-axes " + axes,
      [](Reading& r) { r.folder.opengl_axes = !r.folder.opengl_axes; });
  add("with the poses inverted and " + axes + " camera axes",
      "--poses " + direction + " --camera-axes " + axes, [](Reading& r) {
        r.folder.poses_world_to_camera = !r.folder.poses_world_to_camera;
        r.folder.opengl_axes = !r.folder.opengl_axes;
      });
  std::ostringstream number;
  const auto text = [&number](double value) {
    number.str("");
    number << value;
    return number.str();
  };
  // Of cameras and data sets, and what is a factor away.
  std::vector<double> scales = {100.0, 256.0, 1000.0, 4000.0, 5000.0, 6553.5, 8000.0, 10000.0};
  for (const double factor : {0.1, 10.0, 0.001, 1000.0}) scales.push_back(folder.unitsPerMetre() / factor);
  for (const double scale : scales) {
    const double factor = folder.unitsPerMetre() / scale;
    if (factor == 1.0) continue;
    add("with " + text(scale) + " depth units per metre", "--depth-scale " + text(scale),
        [factor](Reading& r) { r.depth_factor = factor; });
  }
  if (folder.hasQuaternions()) {
    const std::string order = given.quaternions_w_first ? "xyzw" : "wxyz";
    add("with the quaternions read as " + order, "--quaternions " + order,
        [](Reading& r) { r.quaternions_turned = true; });
  }
  for (const double factor : {0.001, 0.01, 1000.0}) {
    const std::string scale = text(factor * given.pose_scale);
    add("with poses in other units", "--pose-scale " + scale,
        [factor](Reading& r) { r.folder.pose_scale *= factor; });
    add("with the poses inverted and in other units", "--poses " + direction + " --pose-scale " + scale,
        [factor](Reading& r) {
          r.folder.pose_scale *= factor;
          r.folder.poses_world_to_camera = !r.folder.poses_world_to_camera;
        });
  }
  const CameraIntrinsics k = folder.intrinsics();
  const auto camera = [&](const std::string& change, const CameraIntrinsics& other) {
    add(change,
        "--intrinsics " + text(other.fx) + "," + text(other.fy) + "," + text(other.cx) + "," + text(other.cy),
        [other](Reading& r) { r.camera = other; });
  };
  CameraIntrinsics centred = k;
  centred.cx = (k.width - 1) / 2.0, centred.cy = (k.height - 1) / 2.0;
  camera("with the principal point in the images' middle", centred);
  for (const double factor : {k.width / (2.0 * k.cx + 1.0), 0.25, 0.5, 2.0}) {
    CameraIntrinsics other = k;
    other.fx *= factor, other.fy *= factor;
    other.cx = (k.width - 1) / 2.0, other.cy = (k.height - 1) / 2.0;
    camera("with the intrinsics scaled by " + text(factor), other);
  }
  // Positive ones are right: where the poses are left-handed, negative ones would agree, and mirror the map.
  CameraIntrinsics positive = k;
  positive.fx = std::abs(k.fx);
  if (k.fx < 0.0) camera("with the sign of fx changed", positive);
  positive = k, positive.fy = std::abs(k.fy);
  if (k.fy < 0.0) camera("with the sign of fy changed", positive);
  positive.fx = std::abs(k.fx);
  if (k.fx < 0.0 && k.fy < 0.0) camera("with the signs of fx and fy changed", positive);
  const bool mirrored =
      given.mirrored_axis != 0 || given.mirrored_positions != 0 || !given.mirrored_rotations.empty();
  if (!mirrored) addMirrors(direction, add);
  return readings;
}

/// Stamps of two clocks: a shift in steps, then finer around the best.
void tryShifts(const Sample& sample, const std::vector<Pair>& pairs, const Reading& as_given,
               FrameCheck& check) {
  if (sample.trajectory.size() < 2) return;
  double best = 0.0, middle = 0.0;
  for (const double step : {0.1, 0.02}) {
    for (int n = -10; n <= 10; ++n) {
      Reading reading = as_given;
      reading.shift = std::round(1000.0 * (middle + n * step)) / 1000.0;
      if (reading.shift == 0.0) continue;
      const PairAgreement agreement = agreementOf(sample, pairs, reading);
      // Frames that have no pose any more must not leave a few lucky ones.
      if (2 * agreement.points < check.as_given.points || agreement.share <= check.best.share) continue;
      std::ostringstream shift;
      shift << as_given.folder.stamp_shift + reading.shift;
      check.best = agreement;
      check.best_change = "with the stamps shifted";
      check.best_option = "--stamp-shift " + shift.str();
      check.best_mirrors = false;
      best = reading.shift;
    }
    middle = best;
  }
}

/// Partners that were taken from elsewhere: enough to tell readings apart, and not so far that nothing is
/// seen by both.
std::vector<Pair> choosePairs(const std::vector<Eigen::Isometry3d>& poses, std::size_t count) {
  constexpr double kTurn = 0.2, kMove = 0.25, kMostTurn = 0.7;
  std::vector<Pair> pairs;
  const std::size_t frames = poses.size(), anchors = std::min(count, frames);
  for (std::size_t n = 0; n < anchors; ++n) {
    const std::size_t a = n * frames / anchors;
    for (std::size_t b = a + 1; b < frames; ++b) {
      const Eigen::Isometry3d T = poses[a].inverse() * poses[b];
      const double turn = std::abs(Eigen::AngleAxisd(T.linear()).angle());
      if (turn > kMostTurn) break;
      if (turn < kTurn && T.translation().norm() < kMove) continue;
      pairs.push_back({a, b});
      break;
    }
  }
  // Frames far apart, or a camera that hardly moved: whatever there is.
  for (std::size_t n = 0; pairs.size() < 4 && n + 1 < frames; ++n) pairs.push_back({n, n + 1});
  return pairs;
}

}  // namespace

FrameCheck::Verdict FrameCheck::verdict() const {
  if (as_given.points < kLeastPoints) return Verdict::kTooLittle;
  // Some mistakes are small in most views; that another reading leaves hardly anything unexplained tells
  // them.
  const bool all_explained = as_given.share < (best_mirrors ? kNothingToAskOfMirrors : kNothingToAsk) &&
                             1.0 - best.share < kLeftOver * (1.0 - as_given.share);
  const bool explained =
      (best.share >= kConvincing && best.share > as_given.share + kClearlyBetter) || all_explained;
  if (explained || as_given.share < kNonsense) return Verdict::kNonsense;
  return as_given.share < kGood ? Verdict::kDoubtful : Verdict::kGood;
}

std::string FrameCheck::message() const {
  const auto percent = [](double share) { return std::to_string(std::lround(100.0 * share)) + " %"; };
  std::string text =
      "the frames contradict one another: as given " + percent(as_given.share) + " of the points agree";
  if (!best_change.empty() &&
      (best.share > as_given.share + 0.5 * kClearlyBetter || verdict() == Verdict::kNonsense) &&
      best.share > as_given.share) {
    text = best_change + " " + percent(best.share) + " of the points agree, as given " +
           percent(as_given.share) + ": " + best_option;
  }
  std::ostringstream range;
  range.precision(3);
  if (in_range < 0.5)
    range << " (" << percent(in_range) << " of the readings are in range, their median is " << median_depth
          << " m)";
  return text + range.str();
}

FrameCheck checkFrames(const FrameFolder& folder, const FrameFolderOptions& given,
                       const std::vector<FrameEntry>& entries, const FrameCheckOptions& options) {
  std::vector<Eigen::Isometry3d> poses;
  std::vector<std::size_t> places;
  for (std::size_t n = 0; n < entries.size(); ++n) {
    try {
      poses.push_back(entries[n].pose ? *entries[n].pose : readPose(entries[n].pose_path));
      places.push_back(n);
    } catch (const std::exception&) {
    }
  }
  FrameCheck check;
  const std::vector<Pair> chosen = choosePairs(poses, options.pairs);
  Sample sample;
  auto& frames = sample.frames;
  for (const FrameEntry& frame : folder.frames()) {
    if (frame.pose && frame.stamp != 0.0) sample.trajectory.push_back({frame.stamp, *frame.pose});
  }
  const auto load = [&](std::size_t n) {
    if (frames.count(n) != 0) return true;
    try {
      DepthImage image = folder.depth(entries[places[n]]);
      if (image.width != folder.intrinsics().width || image.height != folder.intrinsics().height)
        return false;
      frames[n] = {std::move(image), poses[n], entries[places[n]].stamp};
      return true;
    } catch (const std::exception&) {
      return false;
    }
  };
  std::vector<Pair> pairs;
  for (const Pair& pair : chosen) {
    if (load(pair.a) && load(pair.b)) pairs.push_back(pair);
  }
  std::vector<float> depths;
  std::size_t in_range = 0;
  for (const auto& [place, frame] : frames) {
    for (std::size_t n = 0; n < frame.image.depth.size(); n += 31) {
      const float z = frame.image.depth[n];
      if (!(z > 0.0F)) continue;
      depths.push_back(z);
      in_range += z >= options.min_depth && z <= options.max_depth ? 1 : 0;
    }
  }
  if (!depths.empty()) {
    check.in_range = static_cast<double>(in_range) / static_cast<double>(depths.size());
    check.median_depth = static_cast<double>(upperMedian(depths));
  }
  const std::vector<Reading> readings = usualMistakes(folder, given);
  check.as_given = agreementOf(sample, pairs, readings.front());
  if (check.as_given.share >= kNothingToAskOfMirrors) return check;
  const bool mirrors_only = check.as_given.share >= kNothingToAsk;
  for (std::size_t n = 1; n < readings.size(); ++n) {
    if (mirrors_only && !readings[n].mirrored) continue;
    // Depths that no camera measures explain nothing.
    const double depth = readings[n].depth_factor * check.median_depth;
    if (readings[n].depth_factor != 1.0 && (depth < options.min_depth || depth > options.max_depth)) continue;
    const PairAgreement agreement = agreementOf(sample, pairs, readings[n]);
    if (agreement.share <= check.best.share) continue;
    check.best = agreement;
    check.best_change = readings[n].change;
    check.best_option = readings[n].option;
    check.best_mirrors = readings[n].mirrored;
  }
  if (!mirrors_only) tryShifts(sample, pairs, readings.front(), check);
  return check;
}

}  // namespace ttsdf

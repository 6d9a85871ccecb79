// update: new frames change the maps that they see, and no other.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <stdexcept>

#include "../source_flags.h"
#include "../source_frames.h"
#include "atlas_commands.h"
#include "map_change.h"
#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/fusion/volume_parts.h"
#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/readers/cloud_file.h"
#include "ttsdf_localization/signed_field/ideal_volume.h"
#include "ttsdf_localization/surface/surface_mesh.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/json_file.h"
#include "ttsdf_localization/tools/progress.h"

namespace ttsdf {

namespace {

struct UpdateArguments {
  std::string folder, report;
  BuildArguments source;  ///< frames, fusion, build
  double min_change = 0.005;
  bool rank_given = false, support_given = false;
};

/// The frames of the new sequence, in the atlas' frame. Those that cannot be used are said and skipped.
class NewFrames {
 public:
  NewFrames(const BuildArguments& a, Progress& progress)
      : a_(a),
        progress_(progress),
        options_(frameFolderOptions(a)),
        folder_(a.frames, options_),
        list_(folder_.select(a.every, a.offset)),
        skipped_(list_.size(), false) {
    readPoses();
    if (left() > 0 && !folder_.holdsClouds()) requireAgreement();
  }
  std::size_t size() const { return list_.size(); }
  /// Those that can be used, as far as is known.
  std::size_t left() const {
    return static_cast<std::size_t>(std::count(skipped_.begin(), skipped_.end(), false));
  }
  /// Why, each with its file.
  const std::vector<std::string>& reasons() const { return reasons_; }
  /// Some of its points in the atlas [m]; none of a frame that is skipped.
  Eigen::Matrix3Xf pointsOf(std::size_t n) {
    constexpr int kEvery = 8;
    Eigen::Matrix3Xf points(3, 0);
    use(n, [&] {
      points = folder_.holdsClouds() ? Eigen::Matrix3Xf(readScanFile(list_[n].depth_path))
                                     : toPoints(folder_.depth(list_[n]), folder_.intrinsics(), kEvery,
                                                a_.fusion.min_depth, a_.fusion.max_depth);
    });
    const Eigen::Isometry3f T = poses_[n].cast<float>();
    return (T.linear() * points).colwise() + T.translation();
  }
  /// False: it is skipped.
  bool fuse(std::size_t n, const Eigen::Isometry3d& T_map_atlas, TsdfVolume& volume) {
    return use(n, [&] {
      if (folder_.holdsClouds()) {
        volume.integrate(readScanFile(list_[n].depth_path), T_map_atlas * poses_[n]);
      } else {
        volume.integrate(folder_.depth(list_[n]), folder_.intrinsics(), T_map_atlas * poses_[n]);
      }
    });
  }

 private:
  template <class Use>
  bool use(std::size_t n, const Use& use_it) {
    if (skipped_[n]) return false;
    try {
      use_it();
    } catch (const std::exception& error) {
      skip(n, error.what());
    }
    return !skipped_[n];
  }
  void skip(std::size_t n, const std::string& reason) {
    reasons_.push_back(withFile(list_[n], reason));
    progress_.warn("frame skipped: " + reasons_.back());
    skipped_[n] = true;
  }
  void readPoses() {
    std::vector<Eigen::Isometry3d> usable;
    std::vector<std::size_t> places;
    poses_.assign(list_.size(), Eigen::Isometry3d::Identity());
    for (std::size_t n = 0; n < list_.size(); ++n) {
      if (!use(n, [&] { poses_[n] = folder_.pose(list_[n]); })) continue;
      usable.push_back(poses_[n]);
      places.push_back(n);
    }
    for (const auto& [place, distance] : strayPoses(usable)) {
      skip(places[place], strayPoseReason(list_[places[place]], distance));
    }
  }
  /// Before the first map is changed: frames that contradict one another would spoil good maps.
  void requireAgreement() {
    std::vector<FrameEntry> usable;
    for (std::size_t n = 0; n < list_.size(); ++n) {
      if (!skipped_[n]) usable.push_back(list_[n]);
    }
    checkAgreement(a_, folder_, options_, usable, progress_);
  }

  const BuildArguments& a_;
  Progress& progress_;
  const FrameFolderOptions options_;
  const FrameFolder folder_;
  const std::vector<FrameEntry> list_;
  std::vector<bool> skipped_;
  std::vector<Eigen::Isometry3d> poses_;
  std::vector<std::string> reasons_;
};

/// Per map, the frames of which it holds at least a twentieth of the points.
std::vector<std::vector<std::size_t>> framesOfMaps(const Atlas& atlas, NewFrames& frames,
                                                   Progress& progress) {
  constexpr Eigen::Index kShare = 20;
  std::vector<std::vector<std::size_t>> seen(atlas.maps.size());
  std::vector<OrientedBox> boxes;
  for (const AtlasMap& map : atlas.maps) boxes.push_back(map.box());
  for (std::size_t n = 0; n < frames.size(); ++n) {
    progress.update("looking at frames", static_cast<double>(n) / static_cast<double>(frames.size()));
    const Eigen::Matrix3Xd points = frames.pointsOf(n).cast<double>();
    Eigen::AlignedBox3d bounds;
    for (Eigen::Index k = 0; k < points.cols(); ++k) {
      if (points.col(k).allFinite()) bounds.extend(points.col(k));
    }
    if (bounds.isEmpty()) continue;
    for (std::size_t m = 0; m < boxes.size(); ++m) {
      if (!boxes[m].bounds().intersects(bounds)) continue;
      Eigen::Index inside = 0;
      for (Eigen::Index k = 0; k < points.cols(); ++k) inside += boxes[m].depth(points.col(k)) > 0.0 ? 1 : 0;
      if (inside > 0 && kShare * inside >= points.cols()) seen[m].push_back(n);
    }
  }
  return seen;
}

/// What a map says of its place, as if it had been fused from one frame, head on.
TsdfVolume volumeOf(const TtSdfMap& map, const AtlasMap& entry, FusionOptions options) {
  options.voxel_size = map.geometry.voxel_size;
  options.truncation = std::max(map.truncation, options.voxel_size);
  const auto field = makeField(map);
  const double deepest =
      map.clamp_negative > 0.0 ? std::min(map.clamp_negative, options.truncation) : options.truncation;
  const auto matter = static_cast<float>(-0.98 * deepest);  // a clamped value says no distance
  const Eigen::AlignedBox3d box = OrientedBox{entry.T_map_box, entry.size}.bounds();
  const Eigen::Vector3d origin = field->geometry().origin;
  const Eigen::Array3i begin = ((box.min() - origin) / options.voxel_size).array().floor().cast<int>(),
                       end = ((box.max() - origin) / options.voxel_size).array().ceil().cast<int>();
  const DistanceSampler sampler = [&](const Eigen::Array3i& from, const Dims& size, float* out) {
    Eigen::Matrix3Xf points(3, size.prod());
    Eigen::Index n = 0;
    for (int k = 0; k < size[2]; ++k) {
      for (int j = 0; j < size[1]; ++j) {
        for (int i = 0; i < size[0]; ++i, ++n) {
          const Eigen::Array3d index = (from + Eigen::Array3i(i, j, k)).cast<double>();
          points.col(n) = (options.voxel_size * index).matrix().cast<float>();
        }
      }
    }
    const FieldSamples samples = field->evaluate(points);
    for (n = 0; n < points.cols(); ++n) {
      const bool known =
          samples.states[static_cast<std::size_t>(n)] == PointState::kValid && samples.values[n] > matter;
      out[n] = known ? samples.values[n] : -std::numeric_limits<float>::infinity();
    }
  };
  TsdfVolume volume = idealVolume(sampler, begin, end - begin + 1, options);
  volume.setOrigin(origin);
  return volume;
}

/// Of what a map was made of; around that is margin, and with each update it would grow otherwise.
Eigen::AlignedBox3d surfaceBox(const TtSdfMap& map) {
  const SurfaceMesh mesh = extractSurface(map);
  Eigen::AlignedBox3d box;
  for (Eigen::Index n = 0; n < mesh.vertices.cols(); ++n)
    box.extend(mesh.origin + mesh.vertices.col(n).cast<double>());
  const double rounding = 0.01 * map.geometry.voxel_size;
  box.min().array() -= rounding, box.max().array() += rounding;
  return box;
}

struct Updated {
  std::vector<std::uint8_t> bytes;
  MapChange change;
  std::size_t frames = 0;
};

Updated updateMap(const UpdateArguments& a, const AtlasMap& entry, NewFrames& frames,
                  const std::vector<std::size_t>& seen) {
  const std::vector<std::uint8_t> old_bytes = readFile(mapPath(a.folder, entry));
  const TtSdfMap old = deserialize(old_bytes.data(), old_bytes.size());
  const std::string id = fileInfo(old_bytes.data(), old_bytes.size()).map_id;
  if (id != entry.map_id) {
    throw std::runtime_error("got a file with id " + id + ", wanted " + entry.map_id +
                             " as atlas.yaml says (rollback, or add --replace)");
  }
  TsdfVolume volume = volumeOf(old, entry, a.source.fusion);
  const Eigen::Isometry3d T_map_atlas = entry.T_atlas_map.inverse();
  std::size_t fused = 0;
  for (const std::size_t n : seen) fused += frames.fuse(n, T_map_atlas, volume) ? 1 : 0;
  if (fused == 0) throw std::runtime_error("got no frame of it that can be used, wanted one");
  const TsdfVolume part = partOf(volume, surfaceBox(old));
  BuildOptions build = a.source.build;
  // The map knows its surface that far sideways already; with each update it would creep on.
  if (!a.support_given)
    build.support_distance = std::min(build.support_distance, 0.25 * old.geometry.voxel_size);
  if (!a.rank_given)
    build.max_rank = std::to_string(old.train.rank1()) + "," + std::to_string(old.train.rank2());
  BuiltMap built = buildMap(part, build, {}, old.agreement);
  return {built.bytes, changeOf(old, built.map), fused};
}

Json::Value describe(const AtlasMap& map, std::size_t frames, const MapChange& change, bool replaced) {
  Json::Value entry;
  entry["name"] = map.name;
  entry["version"] = map.version;
  entry["id"] = map.map_id;
  entry["replaced"] = replaced;
  entry["frames"] = static_cast<Json::UInt64>(frames);
  entry["removed"] = change.removed;
  entry["added"] = change.added;
  entry["seen_first"] = change.first;
  entry["moved"] = change.moved;
  return entry;
}

/// The maps that the frames see, one after the other.
class MapUpdater {
 public:
  MapUpdater(const UpdateArguments& a, Atlas& atlas, NewFrames& frames)
      : a_(a), atlas_(atlas), frames_(frames) {
    report_["maps"] = Json::arrayValue;
    report_["failed"] = Json::arrayValue;
  }

  /// What goes wrong with one map is said, and takes nothing from the others.
  void run(std::size_t m, const std::vector<std::size_t>& seen, Progress& progress) {
    ++looked_at_;
    const std::string name = atlas_.maps[m].name;
    try {
      update(m, seen, progress);
    } catch (const std::exception& error) {
      fail("map '" + name + "': " + error.what(), progress);
      report_["failed"].append(name);
    }
  }
  void fail(const std::string& what, Progress& progress) {
    progress.note(what);
    ++failures_;
  }

  const Json::Value& report() const { return report_; }
  int lookedAt() const { return looked_at_; }
  int replaced() const { return replaced_; }
  int failures() const { return failures_; }

 private:
  void update(std::size_t m, const std::vector<std::size_t>& seen, Progress& progress) {
    const AtlasMap before = atlas_.maps[m];
    const Updated updated = updateMap(a_, before, frames_, seen);
    const bool changes = updated.change.largest() >= a_.min_change;
    if (changes) {
      AtlasMap entry = describeMap(before.name, before.file, updated.bytes);
      entry.T_atlas_map = before.T_atlas_map;
      const std::string not_kept = putMap(atlas_, a_.folder, entry, updated.bytes);
      if (!not_kept.empty()) progress.warn(not_kept);
      ++replaced_;
      writeAtlas(atlas_, a_.folder);  // map by map: one that was stopped has an atlas that fits its files
    }
    const AtlasMap& now = atlas_.maps[m];
    std::printf(
        "map '%s': %s %d, %zu frames: %.1f %% removed, %.1f %% added, %.1f %% seen for the first time, %.1f "
        "%% moved\n",
        now.name.c_str(), changes ? "now version" : "stays version", now.version, updated.frames,
        100.0 * updated.change.removed, 100.0 * updated.change.added, 100.0 * updated.change.first,
        100.0 * updated.change.moved);
    report_["maps"].append(describe(now, updated.frames, updated.change, changes));
  }

  const UpdateArguments& a_;
  Atlas& atlas_;
  NewFrames& frames_;
  Json::Value report_;
  int looked_at_ = 0, replaced_ = 0, failures_ = 0;
};

void declareUpdate(CommandLine& line, UpdateArguments& a) {
  line.positional("FOLDER", a.folder);
  declareFrames(line, a.source);
  line.value("min-change", "SHARE", a.min_change,
             "Maps of which less was removed, added, seen for the first time and moved stay as they are.")
      .value("report", "FILE", a.report, "Writes what changed as JSON.")
      .options("fusion", fusionOptionTable(), a.source.fusion)
      .options("build", buildOptionTable(), a.source.build);
}

void checkUpdate(const CommandLine& line, const UpdateArguments& a) {
  if (a.source.frames.empty()) throw UsageError("--frames is missing");
  checkFrameFlags(a.source);
  if (!(a.min_change >= 0.0)) throw UsageError("--min-change: wanted 0 or more");
  for (const char* flag : {"voxel-size", "truncation"}) {
    if (line.given(flag))
      throw UsageError(std::string("got --") + flag + ", wanted none: each map keeps its own");
  }
  try {
    validate(a.source.build);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

}  // namespace

int runAtlasUpdate(int argc, char** argv) {
  UpdateArguments a;
  CommandLine line(
      "ttsdf_atlas update", "FOLDER --frames DIR [options]",
      "Fuses new frames, whose poses are of the atlas, into the maps that they see. The versions "
      "before are kept (rollback).");
  declareUpdate(line, a);
  if (!line.parse(argc, argv, std::cout)) return 0;
  checkUpdate(line, a);
  a.rank_given = line.given("max-rank");
  a.support_given = line.given("support-distance");
  if (!a.report.empty()) requireWritable(a.report);  // before the work, not after it
  Progress progress("ttsdf_atlas");
  Atlas atlas = readAtlas(a.folder);
  NewFrames frames(a.source, progress);
  const auto seen = framesOfMaps(atlas, frames, progress);
  if (frames.left() == 0) {
    throw std::runtime_error("frames folder '" + a.source.frames + "': got no usable frame (" +
                             std::to_string(frames.size()) + " skipped), wanted at least one");
  }
  MapUpdater updater(a, atlas, frames);
  for (std::size_t m = 0; m < seen.size(); ++m) {
    progress.update("updating maps", static_cast<double>(m) / static_cast<double>(seen.size()));
    if (!seen[m].empty()) updater.run(m, seen[m], progress);
  }
  std::printf("%d of %zu maps seen, %d replaced\n", updater.lookedAt(), atlas.maps.size(),
              updater.replaced());
  if (updater.replaced() > 0) {
    try {
      updatePlaceIndex(a.folder, progress);
    } catch (const std::exception& error) {
      updater.fail("index of places: " + std::string(error.what()), progress);
    }
  }
  if (!a.report.empty()) {
    Json::Value report = updater.report();
    report["skipped"] = Json::arrayValue;
    for (const std::string& reason : frames.reasons()) report["skipped"].append(reason);
    writeJson(a.report, report);
  }
  if (updater.failures() > 0) {
    throw std::runtime_error("'" + a.folder + "': got " + std::to_string(updater.failures()) +
                             " failures, wanted none (said above; the other maps are up to date)");
  }
  return 0;
}

}  // namespace ttsdf

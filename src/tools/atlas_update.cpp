// update: new frames change the maps that they see, and no other.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <stdexcept>

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
  std::string folder, frames, report;
  int every = 10, offset = 0;
  double min_change = 0.005;
  bool rank_given = false, support_given = false;
  FusionOptions fusion;
  BuildOptions build;
};

/// The frames of the new sequence, in the atlas' frame.
class NewFrames {
 public:
  NewFrames(const UpdateArguments& a) : a_(a), folder_(a.frames), list_(folder_.select(a.every, a.offset)) {
    if (list_.empty())
      throw std::runtime_error("frames folder '" + a.frames + "': got no frame, wanted some");
  }
  std::size_t size() const { return list_.size(); }
  Eigen::Isometry3d pose(std::size_t n) const { return folder_.pose(list_[n]); }
  /// Some of its points in the atlas [m].
  Eigen::Matrix3Xf pointsOf(std::size_t n) const {
    constexpr int kEvery = 8;
    const Eigen::Matrix3Xf points = folder_.holdsClouds()
                                        ? Eigen::Matrix3Xf(readScanFile(list_[n].depth_path))
                                        : toPoints(folder_.depth(list_[n]), folder_.intrinsics(), kEvery,
                                                   a_.fusion.min_depth, a_.fusion.max_depth);
    const Eigen::Isometry3f T = pose(n).cast<float>();
    return (T.linear() * points).colwise() + T.translation();
  }
  void fuse(std::size_t n, const Eigen::Isometry3d& T_map_atlas, TsdfVolume& volume) const {
    if (folder_.holdsClouds()) {
      volume.integrate(readScanFile(list_[n].depth_path), T_map_atlas * pose(n));
    } else {
      volume.integrate(folder_.depth(list_[n]), folder_.intrinsics(), T_map_atlas * pose(n));
    }
  }

 private:
  const UpdateArguments& a_;
  FrameFolder folder_;
  std::vector<FrameEntry> list_;
};

/// Per map, the frames of which it holds at least a twentieth of the points.
std::vector<std::vector<std::size_t>> framesOfMaps(const Atlas& atlas, const NewFrames& frames,
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
};

Updated updateMap(const UpdateArguments& a, const AtlasMap& entry, const NewFrames& frames,
                  const std::vector<std::size_t>& seen) {
  const std::vector<std::uint8_t> old_bytes = readFile(mapPath(a.folder, entry));
  const TtSdfMap old = deserialize(old_bytes.data(), old_bytes.size());
  TsdfVolume volume = volumeOf(old, entry, a.fusion);
  const Eigen::Isometry3d T_map_atlas = entry.T_atlas_map.inverse();
  for (const std::size_t n : seen) frames.fuse(n, T_map_atlas, volume);
  const TsdfVolume part = partOf(volume, surfaceBox(old));
  BuildOptions build = a.build;
  // The map knows its surface that far sideways already; with each update it would creep on.
  if (!a.support_given)
    build.support_distance = std::min(build.support_distance, 0.25 * old.geometry.voxel_size);
  if (!a.rank_given)
    build.max_rank = std::to_string(old.train.rank1()) + "," + std::to_string(old.train.rank2());
  BuiltMap built = buildMap(part, build, {}, old.agreement);
  return {built.bytes, changeOf(old, built.map)};
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

}  // namespace

int runAtlasUpdate(int argc, char** argv) {
  UpdateArguments a;
  CommandLine line(
      "ttsdf_atlas update", "FOLDER --frames DIR [options]",
      "Fuses new frames, whose poses are of the atlas, into the maps that they see. The versions "
      "before are kept (rollback).");
  line.positional("FOLDER", a.folder)
      .value("frames", "DIR", a.frames, "Folder of depth frames with poses, as ttsdf_build takes it.")
      .value("every", "N", a.every, "Takes the frames whose index % N is the offset.")
      .value("offset", "M", a.offset, "See --every.")
      .value("min-change", "SHARE", a.min_change,
             "Maps of which less was removed, added, seen for the first time and moved stay as they are.")
      .value("report", "FILE", a.report, "Writes what changed as JSON.")
      .options("fusion", fusionOptionTable(), a.fusion)
      .options("build", buildOptionTable(), a.build);
  if (!line.parse(argc, argv, std::cout)) return 0;
  if (a.frames.empty()) throw UsageError("--frames is missing");
  if (a.every < 1 || a.offset < 0 || a.offset >= a.every) throw UsageError("wanted 0 <= --offset < --every");
  if (!(a.min_change >= 0.0)) throw UsageError("--min-change: wanted 0 or more");
  a.rank_given = line.given("max-rank");
  a.support_given = line.given("support-distance");
  Progress progress("ttsdf_atlas");
  Atlas atlas = readAtlas(a.folder);
  const NewFrames frames(a);
  const auto seen = framesOfMaps(atlas, frames, progress);
  Json::Value report;
  report["maps"] = Json::arrayValue;
  int replaced = 0, looked_at = 0;
  for (std::size_t m = 0; m < seen.size(); ++m) {
    if (seen[m].empty()) continue;
    progress.update("updating maps", static_cast<double>(m) / static_cast<double>(seen.size()));
    const AtlasMap before = atlas.maps[m];
    const Updated updated = updateMap(a, before, frames, seen[m]);
    const bool changes = updated.change.largest() >= a.min_change;
    ++looked_at;
    if (changes) {
      AtlasMap entry = describeMap(before.name, before.file, updated.bytes);
      entry.T_atlas_map = before.T_atlas_map;
      putMap(atlas, a.folder, entry, updated.bytes);
      writeAtlas(atlas, a.folder);  // map by map: one that was stopped has an atlas that fits its files
      ++replaced;
    }
    const AtlasMap& now = atlas.maps[m];
    std::printf(
        "map '%s': %s %d, %zu frames: %.1f %% removed, %.1f %% added, %.1f %% seen for the first time, %.1f "
        "%% moved\n",
        now.name.c_str(), changes ? "now version" : "stays version", now.version, seen[m].size(),
        100.0 * updated.change.removed, 100.0 * updated.change.added, 100.0 * updated.change.first,
        100.0 * updated.change.moved);
    report["maps"].append(describe(now, seen[m].size(), updated.change, changes));
  }
  std::printf("%d of %zu maps seen, %d replaced\n", looked_at, atlas.maps.size(), replaced);
  if (!a.report.empty()) writeJson(a.report, report);
  if (replaced > 0) updatePlaceIndex(a.folder, progress);
  return 0;
}

}  // namespace ttsdf

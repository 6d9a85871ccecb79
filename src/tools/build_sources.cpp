#include "ttsdf_localization/tools/build_sources.h"

#include <chrono>
#include <filesystem>
#include <iostream>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "source_flags.h"
#include "source_frames.h"
#include "ttsdf_localization/build_steps/extent.h"
#include "ttsdf_localization/exports/octomap_import.h"
#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/fusion/cloud_surface.h"
#include "ttsdf_localization/mesh/mesh_sampling.h"
#include "ttsdf_localization/readers/cloud_file.h"
#include "ttsdf_localization/tools/command_line.h"

namespace ttsdf {

namespace {

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void skip(const FrameEntry& frame, const std::string& reason, Progress& progress, BuildSource& source) {
  source.skipped.push_back(withFile(frame, reason));
  progress.warn("frame skipped: " + source.skipped.back());
  source.skipped_names.push_back(std::filesystem::path(frame.depth_path).filename().string());
}

/// One pose kilometres away from the others would cost all the memory.
void skipStrayPoses(const FrameFolder& folder, std::vector<FrameEntry>& frames, Progress& progress,
                    BuildSource& source) {
  std::vector<Eigen::Isometry3d> poses;
  std::vector<std::size_t> places;
  for (std::size_t n = 0; n < frames.size(); ++n) {
    try {
      poses.push_back(folder.pose(frames[n]));
      places.push_back(n);
    } catch (const std::runtime_error&) {  // said when the frame's turn comes
    }
  }
  const auto stray = strayPoses(poses);
  for (auto it = stray.rbegin(); it != stray.rend(); ++it) {
    const auto frame = frames.begin() + static_cast<std::ptrdiff_t>(places[it->first]);
    skip(*frame, strayPoseReason(*frame, it->second), progress, source);
    frames.erase(frame);
  }
}

/// Nothing was fused: what the readings are like says why.
[[noreturn]] void failWithoutSurface(const BuildArguments& a, const FrameCheck& check, std::size_t frames) {
  std::ostringstream text;
  text << "frame folder '" << a.frames << "': got no surface from " << frames << " frames: ";
  if (check.median_depth > 0.0) {
    text << "the median of their readings is " << check.median_depth << " m, wanted readings from "
         << a.fusion.min_depth << " to " << a.fusion.max_depth
         << " m (--min-depth, --max-depth, --depth-scale)";
  } else {
    text << "wanted readings in the images (0 and 65535 are none)";
  }
  throw std::runtime_error(text.str());
}

TsdfVolume fuseFrames(const BuildArguments& a, Progress& progress, BuildSource& source) {
  const FrameFolderOptions given = frameFolderOptions(a);
  const FrameFolder folder(a.frames, given);
  std::cout << "frames: " << folder.description() << std::endl;
  auto selected = folder.select(a.every, a.offset);
  skipStrayPoses(folder, selected, progress, source);
  FrameCheck check;
  if (!folder.holdsClouds()) check = checkAgreement(a, folder, given, selected, progress);
  TsdfVolume volume(a.fusion);
  FrameComparison comparison(a.fusion);
  const auto compare = [&](const auto&... frame) {
    const auto start = std::chrono::steady_clock::now();
    comparison.add(frame...);
    source.comparing += secondsSince(start);
  };
  for (std::size_t n = 0; n < selected.size(); ++n) {
    progress.update("fusing frames", static_cast<double>(n) / static_cast<double>(selected.size()));
    try {
      const auto T_map_camera = folder.pose(selected[n]);
      if (folder.holdsClouds()) {
        const auto points = readScanFile(selected[n].depth_path);
        volume.integrate(points, T_map_camera);
        compare(points, T_map_camera);
      } else {
        const auto image = folder.depth(selected[n]);
        volume.integrate(image, folder.intrinsics(), T_map_camera);
        compare(image, folder.intrinsics(), T_map_camera);
      }
      ++source.frames;
      source.indices.push_back(selected[n].index);
    } catch (const std::exception& error) {
      skip(selected[n], error.what(), progress, source);
    }
  }
  if (source.frames == 0) {
    throw std::runtime_error("frames folder '" + a.frames + "': got no usable frame with index % " +
                             std::to_string(a.every) + " == " + std::to_string(a.offset) + " (" +
                             std::to_string(source.skipped.size()) + " skipped), wanted at least one");
  }
  if (volume.empty()) failWithoutSurface(a, check, source.frames);
  progress.update("comparing frames", 0.0);
  const auto start = std::chrono::steady_clock::now();
  source.differences = comparison.compare();
  source.agreement = summarize(source.differences, volume.options().voxel_size);
  source.comparing += secondsSince(start);
  return volume;
}

TsdfVolume readVolume(const BuildArguments& a, Progress& progress) {
  progress.update("reading the .vdb file", 0.0);
  std::string note;
  VdbImport import;
  import.grid = a.grid;
  import.scale = a.scale;
  import.note = &note;
  auto volume = TsdfVolume::fromVdbFile(a.vdb, a.fusion, import);
  if (!note.empty()) progress.note(note);
  return volume;
}

TsdfVolume volumeOfCloud(const BuildArguments& a, const OrientedCloud& cloud, Progress& progress,
                         const BuildProgress& show) {
  CloudReport report;
  TsdfVolume volume = volumeFromCloud(cloud, a.fusion, &report, show);
  const std::string name = a.cloud.empty() ? a.octomap : a.cloud;
  if (report.normals_estimated) {
    progress.note("'" + name + "': normals estimated, turned " +
                  (cloud.viewpoint
                       ? std::string("towards the file's viewpoint")
                       : "towards the " + a.cloud_from + " (--cloud-from " +
                             (a.cloud_from == "inside" ? "outside" : "inside") + " turns them round)"));
  }
  if (!report.outliers.empty()) progress.warn("'" + name + "': " + report.outliers);
  std::vector<Eigen::Vector3d> points;
  for (Eigen::Index n = 0; n < cloud.points.cols(); ++n) points.emplace_back(cloud.points.col(n));
  const std::string rounding = describeRounding(points, a.fusion.voxel_size);
  if (!rounding.empty()) progress.warn("'" + name + "': " + rounding);
  if (report.spacing > 3.0 * a.fusion.voxel_size) {
    progress.warn("'" + name + "': points lie " + std::to_string(report.spacing) +
                  " m apart, too far for voxels of " + std::to_string(a.fusion.voxel_size) +
                  " m: the surface has holes");
  }
  return volume;
}

TsdfVolume readCloud(const BuildArguments& a, Progress& progress, const BuildProgress& show) {
  CloudFile file = readCloudFile(a.cloud);
  if (file.whole_numbers && a.scale == 1.0) {
    throw std::runtime_error(
        "scan '" + a.cloud +
        "': got whole numbers for x y z, wanted their unit (--scale 0.001: millimetres)");
  }
  OrientedCloud cloud;
  cloud.points = a.scale * file.points;
  cloud.normals = std::move(file.normals);
  cloud.seen_from_inside = a.cloud_from == "inside";
  if (file.T_points_sensor) cloud.viewpoint = a.scale * file.T_points_sensor->translation();
  try {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (Eigen::Index n = 0; n < cloud.points.cols(); ++n) {
      const Eigen::Vector3d p = cloud.points.col(n);
      if (p.allFinite()) low = low.cwiseMin(p), high = high.cwiseMax(p);
    }
    if ((low.array() <= high.array()).all()) refuseTiny(low, high, a.fusion.voxel_size);
    return volumeOfCloud(a, cloud, progress, show);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error("scan '" + a.cloud + "': " + error.what());
  }
}

TsdfVolume readTree(const BuildArguments& a, Progress& progress, const BuildProgress& show) {
  double resolution = 0.0;
  OrientedCloud cloud = readOctomap(a.octomap, &resolution);
  cloud.points *= a.scale;
  resolution *= a.scale;
  if (a.fusion.voxel_size < 0.5 * resolution) {
    progress.warn("'" + a.octomap + "': cells of " + std::to_string(resolution) +
                  " m do not say more than --voxel-size " + std::to_string(resolution));
  }
  return volumeOfCloud(a, cloud, progress, show);
}

void warnOfOutliers(const SurfaceMesh& mesh, double voxel_size, Progress& progress) {
  std::vector<Eigen::Vector3d> vertices;
  for (Eigen::Index n = 0; n < mesh.vertices.cols(); ++n) {
    vertices.emplace_back(mesh.origin + mesh.vertices.col(n).cast<double>());
  }
  const std::string outliers = describeOutliers(vertices, "vertices");
  if (!outliers.empty()) progress.warn("mesh: " + outliers);
  const std::string rounding = describeRounding(vertices, voxel_size);
  if (!rounding.empty()) progress.warn("mesh: " + rounding);
}

}  // namespace

TsdfVolume volumeFromSource(const BuildArguments& a, Progress& progress, BuildSource& source) {
  const BuildProgress show = [&progress](const std::string& step, double share) {
    progress.update(step, share);
    return true;
  };
  const auto start = std::chrono::steady_clock::now();
  TsdfVolume volume = !a.frames.empty()  ? fuseFrames(a, progress, source)
                      : !a.cloud.empty() ? readCloud(a, progress, show)
                      : !a.vdb.empty()   ? readVolume(a, progress)
                                         : readTree(a, progress, show);
  source.seconds = secondsSince(start) - source.comparing;
  return volume;
}

BuiltMap buildFromSource(const BuildArguments& a, Progress& progress, BuildSource& source) {
  const BuildProgress show = [&progress](const std::string& step, double share) {
    progress.update(step, share);
    return true;
  };
  const auto start = std::chrono::steady_clock::now();
  if (!a.mesh.empty()) {
    progress.update("reading the mesh", 0.0);
    const SurfaceMesh mesh = readMesh(a.mesh, a.scale);
    const Eigen::Vector3d low = mesh.vertices.rowwise().minCoeff().cast<double>(),
                          high = mesh.vertices.rowwise().maxCoeff().cast<double>();
    try {
      refuseTiny(low, high, a.fusion.voxel_size);
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error("mesh '" + a.mesh + "': " + error.what());
    }
    bool warned = false;
    const BuildProgress warn = [&](const std::string& step, double share) {
      if (!warned)
        warnOfOutliers(mesh, a.fusion.voxel_size,
                       progress);  // once it is clear that the mesh is not too large at all
      warned = true;
      return show(step, share);
    };
    const auto field = sampleMesh(mesh, a.fusion.voxel_size, a.build, warn);
    source.seconds = secondsSince(start);
    return compress(field, a.fusion, a.build, show);
  }
  const TsdfVolume volume = volumeFromSource(a, progress, source);
  if (!a.save_vdb.empty()) volume.saveVdb(a.save_vdb);
  return buildMap(volume, a.build, show, source.agreement);
}

}  // namespace ttsdf

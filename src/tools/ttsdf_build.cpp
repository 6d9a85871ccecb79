// From depth frames, a mesh, a cloud, a .vdb file or an octree to a compressed map.

#include <json/json.h>

#include <array>
#include <cstdio>
#include <iostream>

#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/tools/build_sources.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/json_file.h"
#include "ttsdf_localization/tools/progress.h"

namespace {

void declare(ttsdf::CommandLine& line, ttsdf::BuildArguments& a) {
  line.value("frames", "DIR", a.frames,
             "Folder of depth frames with poses. Its layout is found out: 7-Scenes / 3DMatch "
             "(frame-NNNNNN.depth.png, "
             "frame-NNNNNN.pose.txt, camera-intrinsics.txt), BundleFusion, ScanNet, TUM RGB-D, Redwood / "
             "Open3D, ICL-NUIM, "
             "Replica.")
      .value("mesh", "FILE", a.mesh, "Mesh: .ply, .obj, .off, .stl, .gltf or .glb.")
      .value("vdb", "FILE", a.vdb, "Level set or truncated signed distance grid (OpenVDB).")
      .value("cloud", "FILE", a.cloud,
             "Points of surfaces: .pcd, .ply, .xyz, .csv or .bin; normals are used or estimated.")
      .value("cloud-from", "SIDE", a.cloud_from,
             "Where free space is for a cloud without normals and viewpoint: inside (rooms) or outside "
             "(objects).")
      .value("octomap", "FILE", a.octomap, "Octree of octomap: .bt or .ot.")
      .value("grid", "NAME", a.grid, "Grid of the .vdb file, where it holds several.")
      .value("output", "MAP.ttsdf", a.output, "The map.")
      .value("report", "REPORT.json", a.report, "Figures of the build.")
      .value("save-vdb", "FILE", a.save_vdb, "Keeps the uncompressed truncated signed distance volume.")
      .value("depth-scale", "N", a.depth_scale,
             "Units of the depth images per metre; 0: as the layout has it (1000; TUM and ICL-NUIM 5000).")
      .value("poses", "DIRECTION", a.poses, "What the poses map: camera-to-world or world-to-camera.")
      .value("camera-axes", "AXES", a.camera_axes,
             "opencv (x right, y down, z forward) or opengl (x right, y up, z backward).")
      .value("mirror-poses", "AXIS", a.mirror_poses,
             "Poses of a left-handed system: x, y (Unity) or z is turned round; none.")
      .value("quaternions", "ORDER", a.quaternions, "xyzw or wxyz, where the poses are quaternions.")
      .value("pose-scale", "S", a.pose_scale, "Metres per unit of the poses.")
      .value("stamp-shift", "SECONDS", a.stamp_shift,
             "Added to the stamps of images before their poses are looked up.")
      .value("intrinsics", "FX,FY,CX,CY", a.intrinsics, "Instead of those of the folder.")
      .flag("trust-frames", a.trust_frames, "Builds even if the frames contradict one another.")
      .value("every", "N", a.every, "Takes the frames whose index % N is the offset.")
      .value("offset", "M", a.offset, "See --every.")
      .value("scale", "S", a.scale, "Metres per unit of the mesh, cloud, .vdb file or octree.")
      .options("fusion", ttsdf::fusionOptionTable(), a.fusion)
      .options("build", ttsdf::buildOptionTable(), a.build);
}

void check(const ttsdf::BuildArguments& a) {
  const int sources =
      !a.frames.empty() + !a.mesh.empty() + !a.vdb.empty() + !a.cloud.empty() + !a.octomap.empty();
  if (sources != 1) {
    throw ttsdf::UsageError("got " + std::to_string(sources) +
                            " sources, wanted one of --frames, --mesh, --cloud, --vdb, --octomap");
  }
  if (a.output.empty()) throw ttsdf::UsageError("--output is missing");
  if (a.every < 1 || a.offset < 0 || a.offset >= a.every) {
    throw ttsdf::UsageError("got --every " + std::to_string(a.every) + " --offset " +
                            std::to_string(a.offset) + ", wanted 0 <= offset < every");
  }
  if (!a.mesh.empty() && !a.save_vdb.empty()) {
    throw ttsdf::UsageError("got --save-vdb with --mesh, wanted --frames or --vdb: a mesh is not fused");
  }
  if (!a.mesh.empty() && a.build.field == "tsdf") {
    throw ttsdf::UsageError(
        "got --field tsdf with --mesh, wanted --clamp-negative and --clamp-positive: a mesh is not fused");
  }
  if (a.vdb.empty() && !a.grid.empty()) throw ttsdf::UsageError("got --grid without --vdb");
  if (!a.frames.empty() && a.scale != 1.0) {
    throw ttsdf::UsageError(
        "got --scale with --frames, wanted --depth-scale (units of the depth images per metre)");
  }
  if (!(a.depth_scale >= 0.0)) throw ttsdf::UsageError("--depth-scale: wanted a number above 0");
  if (!(a.pose_scale > 0.0)) throw ttsdf::UsageError("--pose-scale: wanted a number above 0");
  if (a.cloud_from != "inside" && a.cloud_from != "outside") {
    throw ttsdf::UsageError("--cloud-from: got '" + a.cloud_from + "', wanted inside or outside");
  }
  if (a.poses != "camera-to-world" && a.poses != "world-to-camera") {
    throw ttsdf::UsageError("--poses: got '" + a.poses + "', wanted camera-to-world or world-to-camera");
  }
  if (a.camera_axes != "opencv" && a.camera_axes != "opengl") {
    throw ttsdf::UsageError("--camera-axes: got '" + a.camera_axes + "', wanted opencv or opengl");
  }
  if (a.mirror_poses != "none" && a.mirror_poses != "x" && a.mirror_poses != "y" && a.mirror_poses != "z") {
    throw ttsdf::UsageError("--mirror-poses: got '" + a.mirror_poses + "', wanted none, x, y or z");
  }
  if (a.quaternions != "xyzw" && a.quaternions != "wxyz") {
    throw ttsdf::UsageError("--quaternions: got '" + a.quaternions + "', wanted xyzw or wxyz");
  }
  if (!(a.scale > 0.0)) throw ttsdf::UsageError("--scale: wanted a number above 0");
  try {
    ttsdf::validate(a.build);
  } catch (const std::invalid_argument& error) {
    throw ttsdf::UsageError(error.what());
  }
}

/// One entry for each frame that was compared.
Json::Value differences(const ttsdf::BuildSource& source) {
  static const std::array<const char*, 3> kOutcomes = {{"compared", "no_overlap", "contradicts"}};
  Json::Value list(Json::arrayValue);
  for (const auto& d : source.differences) {
    Json::Value entry;
    entry["frame"] = source.indices.at(d.frame);
    entry["outcome"] = kOutcomes.at(static_cast<std::size_t>(d.outcome));
    entry["overlap"] = d.overlap;
    if (d.outcome == ttsdf::FrameDifference::Outcome::kCompared) {
      entry["position_m"] = d.translation(), entry["rotation_rad"] = d.rotation();
      // For studies: from the recorded pose to the registered one, and what the scan says of it (sensor's
      // axes).
      for (int n = 0; n < 6; ++n) entry["step"].append(d.step[n]);
      for (int n = 0; n < 36; ++n) entry["covariance"].append(d.covariance(n / 6, n % 6));
      for (int n = 0; n < 3; ++n) entry["centroid"].append(d.centroid[n]);
    }
    list.append(entry);
  }
  return list;
}

Json::Value report(const ttsdf::BuiltMap& built, const ttsdf::BuildSource& source) {
  Json::Value root = ttsdf::parseJson(ttsdf::toJson(built.report), "build report");
  root["frames_used"] = static_cast<Json::UInt64>(source.frames);
  root["frames_skipped"] = Json::arrayValue;
  for (const auto& name : source.skipped_names) root["frames_skipped"].append(name);
  root["skipped"] = Json::arrayValue;
  for (const auto& reason : source.skipped) root["skipped"].append(reason);
  root["seconds"]["read_and_fuse"] = source.seconds;
  root["seconds"]["compare_frames"] = source.comparing;
  root["frame_differences"] = differences(source);
  root["map_id"] = ttsdf::fileInfo(built.bytes.data(), built.bytes.size()).map_id;
  return root;
}

void printSummary(const ttsdf::BuiltMap& built) {
  const auto& dims = built.map.geometry.dims;
  std::printf(
      "%d x %d x %d voxels of %g m, ranks %d and %d, %s: %zu bytes; error near the surface %.1f mm rms\n",
      dims[0], dims[1], dims[2], built.map.geometry.voxel_size, built.report.rank1, built.report.rank2,
      built.report.encoding.c_str(), built.bytes.size(), 1e3 * built.report.surface_rms);
  const auto& agreement = built.map.agreement;
  if (agreement.known()) {
    std::printf("its frames agree to %.1f mm and %.1f mrad (median of %d compared)\n",
                1e3 * agreement.position_median, 1e3 * agreement.rotation_median, agreement.compared);
  }
}

int run(int argc, char** argv) {
  ttsdf::BuildArguments a;
  ttsdf::CommandLine line("ttsdf_build",
                          "(--frames DIR | --mesh FILE | --cloud FILE | --vdb FILE | --octomap FILE) "
                          "--output MAP.ttsdf [options]",
                          "Builds a compressed map.");
  declare(line, a);
  if (!line.parse(argc, argv, std::cout)) return 0;
  check(a);
  ttsdf::requireWritable(a.output, ttsdf::kMapFile);  // before the work, not after it
  if (!a.save_vdb.empty()) ttsdf::requireWritable(a.save_vdb, ttsdf::kVdbFile);
  if (!a.report.empty()) ttsdf::requireWritable(a.report);
  ttsdf::Progress progress("ttsdf_build");
  ttsdf::BuildSource source;
  const auto built = ttsdf::buildFromSource(a, progress, source);
  ttsdf::writeFileAtomically(a.output, built.bytes, ttsdf::kMapFile);
  if (!a.report.empty()) ttsdf::writeJson(a.report, report(built, source));
  printSummary(built);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("ttsdf_build", [&] { return run(argc, argv); });
}

// From depth frames, a mesh or a .vdb file to a compressed map.

#include <json/json.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>

#include "ttsdf_localization/agreement/frame_comparison.h"
#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/mesh/mesh_sampling.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/json_file.h"
#include "ttsdf_localization/tools/progress.h"

namespace {

struct Arguments {
  std::string frames, mesh, vdb, output, report, save_vdb;
  double depth_scale = 1000.0, scale = 1.0;
  int every = 10, offset = 0;
  ttsdf::FusionOptions fusion;
  ttsdf::BuildOptions build;
};

struct Source {
  std::size_t frames = 0;
  std::vector<std::string> skipped;
  std::vector<int> indices;  // of the frames used
  std::vector<ttsdf::FrameDifference> differences;
  ttsdf::FrameAgreement agreement;
  double seconds = 0.0, comparing = 0.0;
};

void declare(ttsdf::CommandLine& line, Arguments& a) {
  line.value("frames", "DIR", a.frames,
             "Folder with frame-NNNNNN.depth.png (16 bit), frame-NNNNNN.pose.txt (4x4 row-major "
             "camera-to-world) and "
             "camera-intrinsics.txt (3x3).")
      .value("mesh", "FILE", a.mesh, "Mesh: .ply, .obj or .off.")
      .value("vdb", "FILE", a.vdb, "Level set or truncated signed distance grid (OpenVDB).")
      .value("output", "MAP.ttsdf", a.output, "The map.")
      .value("report", "REPORT.json", a.report, "Figures of the build.")
      .value("save-vdb", "FILE", a.save_vdb, "Keeps the uncompressed truncated signed distance volume.")
      .value("depth-scale", "N", a.depth_scale, "Units of the depth images per metre.")
      .value("every", "N", a.every, "Takes the frames whose index % N is the offset.")
      .value("offset", "M", a.offset, "See --every.")
      .value("scale", "S", a.scale, "Metres per unit of the mesh.")
      .options("fusion", ttsdf::fusionOptionTable(), a.fusion)
      .options("build", ttsdf::buildOptionTable(), a.build);
}

void check(const Arguments& a) {
  const int sources = !a.frames.empty() + !a.mesh.empty() + !a.vdb.empty();
  if (sources != 1) {
    throw ttsdf::UsageError("got " + std::to_string(sources) +
                            " sources, wanted one of --frames, --mesh, --vdb");
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
  if (!(a.depth_scale > 0.0)) throw ttsdf::UsageError("--depth-scale: wanted a number above 0");
  if (!(a.scale > 0.0)) throw ttsdf::UsageError("--scale: wanted a number above 0");
  try {
    ttsdf::validate(a.build);
  } catch (const std::invalid_argument& error) {
    throw ttsdf::UsageError(error.what());
  }
}

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

ttsdf::TsdfVolume fuseFrames(const Arguments& a, ttsdf::Progress& progress, Source& source) {
  const ttsdf::FrameFolder folder(a.frames, a.depth_scale);
  const auto selected = folder.select(a.every, a.offset);
  ttsdf::TsdfVolume volume(a.fusion);
  ttsdf::FrameComparison comparison(a.fusion);
  for (std::size_t n = 0; n < selected.size(); ++n) {
    progress.update("fusing frames", static_cast<double>(n) / static_cast<double>(selected.size()));
    try {
      const auto T_map_camera = folder.pose(selected[n]);
      const auto image = folder.depth(selected[n]);
      volume.integrate(image, folder.intrinsics(), T_map_camera);
      ++source.frames;
      source.indices.push_back(selected[n].index);
      const auto start = std::chrono::steady_clock::now();
      comparison.add(image, folder.intrinsics(), T_map_camera);
      source.comparing += secondsSince(start);
    } catch (const std::exception& error) {
      progress.note(std::string("ttsdf_build: warning: frame skipped: ") + error.what());
      source.skipped.emplace_back(error.what());
    }
  }
  if (source.frames == 0) {
    throw std::runtime_error("frames folder '" + a.frames + "': got no usable frame with index % " +
                             std::to_string(a.every) + " == " + std::to_string(a.offset) + " (" +
                             std::to_string(source.skipped.size()) + " skipped), wanted at least one");
  }
  progress.update("comparing frames", 0.0);
  const auto start = std::chrono::steady_clock::now();
  source.differences = comparison.compare();
  source.agreement = ttsdf::summarize(source.differences);
  source.comparing += secondsSince(start);
  return volume;
}

ttsdf::BuiltMap buildFromVolume(const Arguments& a, ttsdf::Progress& progress, Source& source,
                                const ttsdf::BuildProgress& show) {
  const auto start = std::chrono::steady_clock::now();
  const auto volume =
      a.vdb.empty() ? fuseFrames(a, progress, source) : ttsdf::TsdfVolume::fromVdbFile(a.vdb, a.fusion);
  source.seconds = secondsSince(start) - source.comparing;
  if (!a.save_vdb.empty()) volume.saveVdb(a.save_vdb);
  return ttsdf::buildMap(volume, a.build, show, source.agreement);
}

ttsdf::BuiltMap buildFromMesh(const Arguments& a, Source& source, const ttsdf::BuildProgress& show) {
  const auto start = std::chrono::steady_clock::now();
  const auto field = ttsdf::sampleMesh(ttsdf::readMesh(a.mesh, a.scale), a.fusion.voxel_size, a.build, show);
  source.seconds = secondsSince(start);
  return ttsdf::compress(field, a.fusion, a.build, show);
}

/// One entry for each frame that was compared.
Json::Value differences(const Source& source) {
  static const std::array<const char*, 3> kOutcomes = {{"compared", "no_overlap", "contradicts"}};
  Json::Value list(Json::arrayValue);
  for (const auto& d : source.differences) {
    Json::Value entry;
    entry["frame"] = source.indices.at(d.frame);
    entry["outcome"] = kOutcomes.at(static_cast<std::size_t>(d.outcome));
    entry["overlap"] = d.overlap;
    if (d.outcome == ttsdf::FrameDifference::Outcome::kCompared) {
      entry["position_m"] = d.translation(), entry["rotation_rad"] = d.rotation();
      for (int k = 0; k < 6; ++k) entry["step"].append(d.step[k]);
      for (int k = 0; k < 36; ++k) entry["cov"].append(d.covariance(k / 6, k % 6));
      for (int k = 0; k < 3; ++k) entry["centroid"].append(d.centroid[k]);
    }
    list.append(entry);
  }
  return list;
}

Json::Value report(const ttsdf::BuiltMap& built, const Source& source) {
  Json::Value root = ttsdf::parseJson(ttsdf::toJson(built.report), "build report");
  root["frames_used"] = static_cast<Json::UInt64>(source.frames);
  root["frames_skipped"] = static_cast<Json::UInt64>(source.skipped.size());
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
  Arguments a;
  ttsdf::CommandLine line("ttsdf_build",
                          "(--frames DIR | --mesh FILE | --vdb FILE) --output MAP.ttsdf [options]",
                          "Builds a compressed map.");
  declare(line, a);
  if (!line.parse(argc, argv, std::cout)) return 0;
  check(a);
  ttsdf::requireWritable(a.output, ttsdf::kMapFile);  // before the work, not after it
  if (!a.save_vdb.empty()) ttsdf::requireWritable(a.save_vdb, ttsdf::kVdbFile);
  if (!a.report.empty()) ttsdf::requireWritable(a.report);
  ttsdf::Progress progress;
  Source source;
  const ttsdf::BuildProgress show = [&progress](const std::string& step, double share) {
    progress.update(step, share);
    return true;
  };
  const auto built =
      a.mesh.empty() ? buildFromVolume(a, progress, source, show) : buildFromMesh(a, source, show);
  ttsdf::writeFileAtomically(a.output, built.bytes, ttsdf::kMapFile);
  if (!a.report.empty()) ttsdf::writeJson(a.report, report(built, source));
  printSummary(built);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("ttsdf_build", [&] { return run(argc, argv); });
}

// From depth frames, a mesh, a cloud, a .vdb file or an octree to a compressed map.

#include <json/json.h>

#include <array>
#include <cstdio>
#include <iostream>

#include "source_flags.h"
#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/tools/build_sources.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/json_file.h"
#include "ttsdf_localization/tools/progress.h"

namespace {

void declare(ttsdf::CommandLine& line, ttsdf::BuildArguments& a) {
  ttsdf::declareSources(line, a);
  line.value("output", "MAP.ttsdf", a.output, "The map.")
      .value("report", "REPORT.json", a.report, "Figures of the build.")
      .value("save-vdb", "FILE", a.save_vdb, "Keeps the uncompressed truncated signed distance volume.")
      .options("fusion", ttsdf::fusionOptionTable(), a.fusion)
      .options("build", ttsdf::buildOptionTable(), a.build);
}

void check(const ttsdf::BuildArguments& a) {
  ttsdf::checkSources(a);
  if (a.output.empty()) throw ttsdf::UsageError("--output is missing");
  if (!a.mesh.empty() && !a.save_vdb.empty()) {
    throw ttsdf::UsageError("got --save-vdb with --mesh, wanted --frames or --vdb: a mesh is not fused");
  }
  if (!a.mesh.empty() && a.build.field == "tsdf") {
    throw ttsdf::UsageError(
        "got --field tsdf with --mesh, wanted --clamp-negative and --clamp-positive: a mesh is not fused");
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

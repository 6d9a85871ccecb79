#include "ros/builder/map_build_request.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "ttsdf_localization/fusion/tsdf_volume.h"
#include "ttsdf_localization/mesh/mesh_sampling.h"
#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

namespace {

void setFromPair(const std::string& pair, BuildOptions& options) {
  const auto equals = pair.find('=');
  if (equals == std::string::npos) {
    throw std::invalid_argument("options: got '" + pair + "', wanted name=value");
  }
  buildOptionTable().setFromText(options, pair.substr(0, equals), pair.substr(equals + 1));
}

template <class Sampler>
SampledSource timed(const Sampler& sampler, const FusionOptions& fusion, std::size_t frames) {
  const auto start = std::chrono::steady_clock::now();
  SampledSource source{sampler(), fusion, frames, 0.0};
  source.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return source;
}

}  // namespace

BuildOptions buildOptionsOf(const ttsdf_localization::BuildMap::Request& request, BuildOptions defaults) {
  const auto& table = buildOptionTable();
  BuildOptions options = std::move(defaults);
  if (!request.field.empty()) table.set(options, "field", request.field);
  if (!request.max_rank.empty()) table.set(options, "max_rank", request.max_rank);
  if (!(request.tolerance == 0.0)) table.set(options, "tolerance", request.tolerance);
  if (!request.encoding.empty()) table.set(options, "encoding", request.encoding);
  if (request.target_bytes > 0) {
    if (request.target_bytes > static_cast<std::uint32_t>(std::numeric_limits<int>::max())) {
      throw std::invalid_argument("target_bytes: got " + std::to_string(request.target_bytes) +
                                  ", wanted at most 2147483647");
    }
    table.set(options, "target_bytes", static_cast<int>(request.target_bytes));
  }
  if (!(request.target_surface_error == 0.0))
    table.set(options, "target_surface_error", request.target_surface_error);
  for (const auto& pair : request.options) setFromPair(pair, options);
  validate(options);
  return options;
}

SampledSource sampleVolume(const TsdfVolume& volume, const BuildOptions& options,
                           const BuildProgress& progress) {
  return timed([&] { return sampleField(volume, options, progress); }, volume.options(), volume.frameCount());
}

SampledSource sampleFile(const std::string& path, double scale, const FusionOptions& fusion,
                         const BuildOptions& options, const BuildProgress& progress) {
  const std::string ending = lowerEnding(path);
  if (!std::isfinite(scale) || scale < 0.0) {
    throw std::invalid_argument("scale: got " + std::to_string(scale) +
                                ", wanted a number above 0 (or 0 for 1)");
  }
  if (ending == ".vdb") return sampleVolume(TsdfVolume::fromVdbFile(path, fusion), options, progress);
  if (ending != ".ply" && ending != ".obj" && ending != ".off") {
    throw std::invalid_argument("source: got '" + path +
                                "', wanted nothing, a .vdb grid or a mesh (.ply, .obj, .off)");
  }
  const SurfaceMesh mesh = readMesh(path, scale > 0.0 ? scale : 1.0);
  return timed([&] { return sampleMesh(mesh, fusion.voxel_size, options, progress); }, fusion, 0);
}

ttsdf_localization::MapReport toMessage(const BuildReport& report, const TtSdfMap& map,
                                        const std::string& map_id) {
  ttsdf_localization::MapReport message;
  message.map_id = map_id;
  message.field = name(map.kind);
  message.encoding = report.encoding;
  for (int axis = 0; axis < 3; ++axis) {
    message.dims[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(map.geometry.dims[axis]);
  }
  message.ranks[0] = static_cast<std::uint32_t>(report.rank1);
  message.ranks[1] = static_cast<std::uint32_t>(report.rank2);
  message.file_bytes = report.file_bytes;
  message.memory_bytes = report.memory_bytes;
  message.dense_bytes = report.dense_bytes;
  message.scans = static_cast<std::uint32_t>(report.frames);
  message.relative_error = report.relative_error;
  message.surface_rms = report.surface_rms;
  message.observed_share = report.observed_share;
  for (const auto& [step, seconds] : report.seconds) {
    message.steps.push_back(step);
    message.seconds.push_back(seconds);
  }
  return message;
}

std::string summary(const ttsdf_localization::MapReport& report) {
  char text[256];
  std::snprintf(
      text, sizeof text,
      "map %s: %u x %u x %u voxels, ranks %u, %u, %.1f kB (dense %.1f MB), surface error %.1f mm, %u scans",
      report.map_id.c_str(), report.dims[0], report.dims[1], report.dims[2], report.ranks[0], report.ranks[1],
      1e-3 * static_cast<double>(report.file_bytes), 1e-6 * static_cast<double>(report.dense_bytes),
      1e3 * report.surface_rms, report.scans);
  return text;
}

}  // namespace ttsdf

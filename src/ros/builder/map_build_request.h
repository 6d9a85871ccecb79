#pragma once
// A BuildMap request, understood: which options, from what source, and the answer's figures.

#include <string>

#include "ttsdf_localization/BuildMap.h"
#include "ttsdf_localization/MapReport.h"
#include "ttsdf_localization/map/tt_sdf_map.h"
#include "ttsdf_localization/mapping/map_builder.h"

namespace ttsdf {

/// The node's options with what the request overrides. Throws std::invalid_argument naming key, value and
/// range.
BuildOptions buildOptionsOf(const ttsdf_localization::BuildMap::Request& request, BuildOptions defaults);

/// What compression starts from, wherever it came from.
struct SampledSource {
  SampledField field;
  FusionOptions fusion;    ///< as used: a file may have had another truncation
  std::size_t frames = 0;  ///< scans fused
  double seconds = 0.0;    ///< that sampling took
};

/// Throws as sampleField does.
SampledSource sampleVolume(const TsdfVolume& volume, const BuildOptions& options,
                           const BuildProgress& progress);
/// A .vdb grid or a mesh, by the file name's ending; `scale` (0: 1) turns mesh units into metres. Throws
/// std::invalid_argument for another ending or a bad scale, std::runtime_error if the file cannot be used.
SampledSource sampleFile(const std::string& path, double scale, const FusionOptions& fusion,
                         const BuildOptions& options, const BuildProgress& progress);

ttsdf_localization::MapReport toMessage(const BuildReport& report, const TtSdfMap& map,
                                        const std::string& map_id);

/// One line for logs and the reply.
std::string summary(const ttsdf_localization::MapReport& report);

}  // namespace ttsdf

#pragma once
// A BuildMap request, understood: which options, from what source, and the answer's figures.

#include <string>

#include "ttsdf_localization/BuildMap.h"
#include "ttsdf_localization/MapReport.h"
#include "ttsdf_localization/map/tt_sdf_map.h"
#include "ttsdf_localization/mapping/map_builder.h"

namespace ttsdf {

/// The node's options with what the request overrides. Throws std::invalid_argument naming key, value and range.
BuildOptions buildOptionsOf(const ttsdf_localization::BuildMap::Request& request, BuildOptions defaults);

/// A map from a .vdb grid or a mesh, by the file name's ending. Throws std::invalid_argument for another ending,
/// std::runtime_error if the file cannot be used.
BuiltMap buildMapFromFile(const std::string& path, double scale, const FusionOptions& fusion, const BuildOptions& options,
                          const BuildProgress& progress);

ttsdf_localization::MapReport toMessage(const BuildReport& report, const TtSdfMap& map, const std::string& map_id);

/// One line for logs and the reply.
std::string summary(const ttsdf_localization::MapReport& report);

}  // namespace ttsdf

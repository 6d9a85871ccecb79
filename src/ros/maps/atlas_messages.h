#pragma once
// An atlas as messages and back.

#include <cstdint>
#include <vector>

#include "ttsdf_localization/AtlasInfo.h"
#include "ttsdf_localization/AtlasMapInfo.h"
#include "ttsdf_localization/atlas/atlas.h"

namespace ttsdf {

ttsdf_localization::AtlasMapInfo toMessage(const AtlasMap& map);
ttsdf_localization::AtlasInfo toMessage(const Atlas& atlas, std::vector<std::uint8_t> places);
/// Throws std::invalid_argument for an atlas that cannot be used.
Atlas fromMessage(const ttsdf_localization::AtlasInfo& message);

}  // namespace ttsdf

#pragma once
// A map's file around cores that are quantised already.

#include <cstdint>
#include <vector>

#include "../../map/codec/quantized_cores.h"
#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

/// Everything of `map` but its train.
std::vector<std::uint8_t> serializeQuantized(const TtSdfMap& map, const QuantizedCores& cores);

}  // namespace ttsdf

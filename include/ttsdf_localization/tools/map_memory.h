#pragma once
// What a map takes in memory: by part, and as the system sees it.

#include <json/value.h>

#include "ttsdf_localization/field/distance_field.h"

namespace ttsdf {

/// Bytes of every part of a field and of the far field beside it (may be null), and their sum
/// `map_memory_bytes`.
Json::Value memoryByPart(const DistanceField& field, const DistanceField* far);

/// Resident memory of this process now, after what was freed went back to the system; and its largest so far
/// [bytes].
std::size_t residentBytes();
std::size_t peakResidentBytes();

}  // namespace ttsdf

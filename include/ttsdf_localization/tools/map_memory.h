#pragma once
// What a map takes in memory: by part, and as the system sees it.

#include <json/value.h>

#include <cstddef>

#include "ttsdf_localization/field/distance_field.h"

namespace ttsdf {

/// Bytes of every part of a field and of the far field beside it (may be null), and their sum
/// `map_memory_bytes`.
Json::Value memoryByPart(const DistanceField& field, const DistanceField* far);

/// Of this process [bytes].
struct ResidentMemory {
  std::size_t all = 0;
  std::size_t data = 0;  ///< without what belongs to files, as the code of programs and libraries
};

/// Now, after what was freed went back to the system.
ResidentMemory residentMemory();
/// The largest so far [bytes].
std::size_t peakResidentBytes();

}  // namespace ttsdf

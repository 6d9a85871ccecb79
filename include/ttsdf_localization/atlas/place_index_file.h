#pragma once
// The index of places of an atlas as a file beside atlas.yaml, so that a robot need not look around in every
// map at its start.

#include <cstdint>
#include <string>
#include <vector>

#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/atlas/place_index.h"

namespace ttsdf {

extern const char* const kPlaceIndexFile;  ///< "places.bin"

/// Per map of an atlas: what its places depend on. Another version or pose of the map or of one that overlaps
/// with it, and the key is another one.
std::vector<std::uint32_t> placeKeys(const Atlas& atlas);

/// Equal indices, equal bytes.
std::vector<std::uint8_t> serialize(const PlaceIndex& index);
/// Throws std::runtime_error saying what is wrong with the bytes; no size in them is trusted.
PlaceIndex deserializePlaces(const std::vector<std::uint8_t>& bytes);

/// What of an index fits the atlas.
PlaceIndex fittingPlaces(const PlaceIndex& index, const Atlas& atlas);

/// The index of a folder as far as it fits the atlas; empty if there is no file. Throws std::runtime_error
/// naming the file.
PlaceIndex readPlaceIndex(const std::string& folder, const Atlas& atlas);
/// Replaces the file as files/file_writer.h has it.
void writePlaceIndex(const PlaceIndex& index, const std::string& folder);

}  // namespace ttsdf

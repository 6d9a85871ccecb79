#pragma once
// What maps of an atlas were before: for each map NAME a folder "versions/NAME" in the atlas, an atlas of its
// own with a map vN for version N.

#include <string>
#include <vector>

#include "ttsdf_localization/atlas/atlas.h"

namespace ttsdf {

/// Puts what a map is now among its versions. Returns why that cannot be: its file is missing, damaged or
/// another map's; empty: it is kept. Throws std::runtime_error naming a file that cannot be written.
std::string keepVersion(const std::string& folder, const AtlasMap& map);
/// Version numbers of a map that are kept, rising.
std::vector<int> keptVersions(const std::string& folder, const std::string& name);
/// A kept version: its entry as it was in the atlas, but for the file, which is the kept one's in `folder`.
/// Throws std::runtime_error if there is none.
AtlasMap keptVersion(const std::string& folder, const std::string& name, int version);
/// Of a map that is taken out of the atlas.
void dropVersions(const std::string& folder, const std::string& name);

/// Id of the map in a map's file, whatever atlas.yaml says; empty: there is no whole map in it.
std::string idOnDisk(const std::string& folder, const AtlasMap& map);

}  // namespace ttsdf

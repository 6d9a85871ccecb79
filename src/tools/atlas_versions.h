#pragma once
// What maps of an atlas were before: a folder "versions" in it, an atlas of its own with a map NAME.vN for
// version N of the map NAME.

#include <string>
#include <vector>

#include "ttsdf_localization/atlas/atlas.h"

namespace ttsdf {

/// Puts what a map is now among its versions. Throws std::runtime_error naming the file, also for a file that
/// is not the map's.
void keepVersion(const std::string& folder, const AtlasMap& map);
/// Version numbers of a map that are kept, rising.
std::vector<int> keptVersions(const std::string& folder, const std::string& name);
/// A kept version: its entry as it was in the atlas, but for the file, which is the kept one's in `folder`.
/// Throws std::runtime_error if there is none.
AtlasMap keptVersion(const std::string& folder, const std::string& name, int version);
/// Of a map that is taken out of the atlas.
void dropVersions(const std::string& folder, const std::string& name);

}  // namespace ttsdf

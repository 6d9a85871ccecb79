#include "atlas_versions.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace ttsdf {

namespace {

namespace fs = std::filesystem;
constexpr const char* kVersions = "versions";
constexpr std::size_t kMostKept = 20;  // of one map; the oldest goes

fs::path homeOf(const std::string& name) { return fs::path(kVersions) / name; }

Atlas readKept(const std::string& home) {
  return fs::exists(fs::path(home) / kAtlasFile) ? readAtlas(home) : Atlas();
}

std::string keptName(int version) { return "v" + std::to_string(version); }

void dropOldest(const std::string& home, Atlas& kept) {
  std::vector<std::string> files;
  while (kept.maps.size() > kMostKept) {
    files.push_back(mapPath(home, kept.maps.front()));
    kept.maps.erase(kept.maps.begin());
  }
  if (files.empty()) return;
  writeAtlas(kept, home);  // first: a file that no atlas names does no harm
  for (const std::string& file : files) fs::remove(file);
}

}  // namespace

std::string keepVersion(const std::string& folder, const AtlasMap& map) {
  const std::string home = (fs::path(folder) / homeOf(map.name)).string();
  Atlas kept = readKept(home);
  AtlasMap entry = map;
  entry.name = keptName(map.version);
  entry.file = entry.name + ".ttsdf";
  const AtlasMap* const there = kept.find(entry.name);
  if (there && there->map_id == map.map_id && idOnDisk(home, *there) == map.map_id)
    return "";  // by an update that was interrupted
  std::vector<std::uint8_t> bytes;
  try {
    bytes = readFile(mapPath(folder, map));
    const std::string id = describeMap(map.name, map.file, bytes).map_id;
    if (id != map.map_id) throw std::runtime_error("got id " + id + ", wanted " + map.map_id);
  } catch (const std::exception& error) {
    return "map '" + map.name + "': version " + std::to_string(map.version) + " is not kept: '" + map.file +
           "': " + error.what();
  }
  fs::create_directories(home);
  if (there) kept.maps.erase(kept.maps.begin() + (there - kept.maps.data()));
  writeFileAtomically(mapPath(home, entry), bytes, kMapFile);
  kept.maps.push_back(entry);
  std::sort(kept.maps.begin(), kept.maps.end(),
            [](const AtlasMap& a, const AtlasMap& b) { return a.version < b.version; });
  writeAtlas(kept, home);
  dropOldest(home, kept);
  return "";
}

std::vector<int> keptVersions(const std::string& folder, const std::string& name) {
  std::vector<int> versions;
  for (const AtlasMap& map : readKept((fs::path(folder) / homeOf(name)).string()).maps)
    versions.push_back(map.version);
  std::sort(versions.begin(), versions.end());
  return versions;
}

AtlasMap keptVersion(const std::string& folder, const std::string& name, int version) {
  const Atlas kept = readKept((fs::path(folder) / homeOf(name)).string());
  const AtlasMap* const map = kept.find(keptName(version));
  if (!map) {
    std::string there;
    for (const AtlasMap& one : kept.maps) there += (there.empty() ? "" : ", ") + std::to_string(one.version);
    throw std::runtime_error("map '" + name + "': got version " + std::to_string(version) +
                             ", wanted one that is kept (" + (there.empty() ? "none is" : there) + ")");
  }
  AtlasMap result = *map;
  result.name = name;
  result.file = (homeOf(name) / map->file).string();
  return result;
}

void dropVersions(const std::string& folder, const std::string& name) {
  fs::remove_all(fs::path(folder) / homeOf(name));
}

std::string idOnDisk(const std::string& folder, const AtlasMap& map) {
  try {
    return describeMap(map.name, map.file, readFile(mapPath(folder, map))).map_id;
  } catch (const std::exception&) {
    return "";
  }
}

}  // namespace ttsdf

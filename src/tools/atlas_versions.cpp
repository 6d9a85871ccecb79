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

std::string homeOf(const std::string& folder) { return (fs::path(folder) / kVersions).string(); }

Atlas readKept(const std::string& folder) {
  const std::string home = homeOf(folder);
  return fs::exists(fs::path(home) / kAtlasFile) ? readAtlas(home) : Atlas();
}

std::string keptName(const std::string& name, int version) { return name + ".v" + std::to_string(version); }

void erase(const std::string& home, Atlas& kept, const std::vector<std::string>& names) {
  std::vector<std::string> files;
  for (const std::string& name : names) {
    const AtlasMap* const map = kept.find(name);
    files.push_back(mapPath(home, *map));
    kept.maps.erase(kept.maps.begin() + (map - kept.maps.data()));
  }
  writeAtlas(kept, home);  // first: a file that no atlas names does no harm
  for (const std::string& file : files) fs::remove(file);
}

std::vector<int> versionsIn(const Atlas& kept, const std::string& name) {
  std::vector<int> versions;
  for (const AtlasMap& map : kept.maps) {
    if (map.name == keptName(name, map.version)) versions.push_back(map.version);
  }
  std::sort(versions.begin(), versions.end());
  return versions;
}

}  // namespace

void keepVersion(const std::string& folder, const AtlasMap& map) {
  const std::string home = homeOf(folder);
  fs::create_directories(home);
  Atlas kept = readKept(folder);
  AtlasMap entry = map;
  entry.name = keptName(map.name, map.version);
  entry.file = entry.name + ".ttsdf";
  if (const AtlasMap* const there = kept.find(entry.name))
    kept.maps.erase(kept.maps.begin() + (there - kept.maps.data()));
  const std::vector<std::uint8_t> bytes = readFile(mapPath(folder, map));
  const std::string id = fileInfo(bytes.data(), bytes.size()).map_id;
  if (id != map.map_id) {
    throw std::runtime_error("map '" + map.name + "': got a file with id " + id + ", wanted " + map.map_id +
                             " as atlas.yaml says: it cannot be kept as version " +
                             std::to_string(map.version));
  }
  writeFileAtomically(mapPath(home, entry), bytes, kMapFile);
  kept.maps.push_back(entry);
  writeAtlas(kept, home);
  std::vector<std::string> old;
  const std::vector<int> versions = versionsIn(kept, map.name);
  for (std::size_t n = 0; n + kMostKept < versions.size(); ++n)
    old.push_back(keptName(map.name, versions[n]));
  if (!old.empty()) erase(home, kept, old);
}

std::vector<int> keptVersions(const std::string& folder, const std::string& name) {
  return versionsIn(readKept(folder), name);
}

AtlasMap keptVersion(const std::string& folder, const std::string& name, int version) {
  const Atlas kept = readKept(folder);
  const AtlasMap* const map = kept.find(keptName(name, version));
  if (!map) {
    std::string there;
    for (const int one : versionsIn(kept, name)) there += (there.empty() ? "" : ", ") + std::to_string(one);
    throw std::runtime_error("map '" + name + "': got version " + std::to_string(version) +
                             ", wanted one that is kept (" + (there.empty() ? "none is" : there) + ")");
  }
  AtlasMap result = *map;
  result.name = name;
  result.file = std::string(kVersions) + "/" + map->file;
  return result;
}

void dropVersions(const std::string& folder, const std::string& name) {
  Atlas kept = readKept(folder);
  std::vector<std::string> names;
  for (const int version : versionsIn(kept, name)) names.push_back(keptName(name, version));
  if (!names.empty()) erase(homeOf(folder), kept, names);
}

}  // namespace ttsdf

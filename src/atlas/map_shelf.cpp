#include "map_shelf.h"

#include <stdexcept>
#include <utility>

#include "ttsdf_localization/field/long_range_field.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

std::size_t MapShelf::bytesOf(const PlacedField& map) {
  return map.field->memoryBytes() + (map.far ? map.far->memoryBytes() : 0);
}

std::size_t MapShelf::bytes() const {
  std::size_t sum = 0;
  for (const auto& [name, item] : maps_) sum += bytesOf(item.placed);
  return sum;
}

bool MapShelf::hasEdition(const AtlasMap& map) const {
  const auto found = maps_.find(map.name);
  return found != maps_.end() && found->second.placed.map_id == map.map_id;
}

std::size_t MapShelf::expected(const AtlasMap& map, std::size_t otherwise) const {
  const auto here = maps_.find(map.name);
  if (here != maps_.end()) return bytesOf(here->second.placed);
  const auto before = measured_.find(map.map_id);
  return before == measured_.end() ? otherwise : before->second;
}

void MapShelf::put(PlacedField map) {
  const std::string name = map.name;
  measured_[map.map_id] = bytesOf(map);
  maps_[name] = {std::move(map), ++clock_};
}

void MapShelf::touch(const std::string& name) {
  const auto found = maps_.find(name);
  if (found != maps_.end()) found->second.wanted = ++clock_;
}

bool MapShelf::makeRoom(std::size_t bytes, std::size_t budget, const std::set<std::string>& keep) {
  while (this->bytes() + bytes > budget) {
    auto oldest = maps_.end();
    for (auto it = maps_.begin(); it != maps_.end(); ++it) {
      if (keep.count(it->first) != 0) continue;
      if (oldest == maps_.end() || it->second.wanted < oldest->second.wanted) oldest = it;
    }
    if (oldest == maps_.end()) return false;
    maps_.erase(oldest);
  }
  return true;
}

void MapShelf::follow(const Atlas& atlas) {
  for (auto it = maps_.begin(); it != maps_.end();) {
    const AtlasMap* const map = atlas.find(it->first);
    if (!map) {
      it = maps_.erase(it);
      continue;
    }
    if (map->map_id == it->second.placed.map_id) it->second.placed.T_atlas_map = map->T_atlas_map;
    ++it;
  }
}

PlacedField loadPlaced(const MapBytes& files, const AtlasMap& map, double megabytes, bool long_range,
                       const MapLimits& limits, const KeepGoing& keep_going) {
  const std::vector<std::uint8_t> bytes = files(map);
  goOn(keep_going);
  const auto named = [&map](const auto& read) {
    try {
      return read();
    } catch (const MapFormatError& error) {
      throw MapFormatError("'" + map.file + "': " + error.what());
    }
  };
  const std::string id = named([&] { return fileInfo(bytes.data(), bytes.size()).map_id; });
  if (id != map.map_id) {
    throw MapFormatError("'" + map.file + "': got id " + id + ", wanted " + map.map_id +
                         " as atlas.yaml says");
  }
  TtFieldOptions options;
  options.memory_megabytes = megabytes;
  PlacedField placed;
  placed.name = map.name;
  placed.map_id = id;
  placed.T_atlas_map = map.T_atlas_map;
  placed.field = makeField(named([&] { return deserialize(bytes.data(), bytes.size(), limits); }), options);
  goOn(keep_going);
  if (long_range) placed.far = makeLongRangeField(*placed.field, {}, keep_going);
  placed.field->warmUp(keep_going);
  return placed;
}

}  // namespace ttsdf

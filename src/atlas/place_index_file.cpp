#include "ttsdf_localization/atlas/place_index_file.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "ttsdf_localization/files/file_writer.h"

namespace ttsdf {

namespace {

constexpr char kMagic[] = "TTSDFPL3";
constexpr char kAnyVersion[] = "TTSDFPL";  // an older one is replaced
constexpr std::size_t kMagicBytes = 8, kCrcBytes = 4;
constexpr std::size_t kPlaceBytes = sizeof(PlaceRanges) + 3 * 2;

std::uint32_t crcOf(const std::uint8_t* data, std::size_t size) {
  return static_cast<std::uint32_t>(crc32_z(0, data, size));
}

void put(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
  for (int n = 0; n < 4; ++n) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * n)));
}

/// Takes bytes from the front and throws when they run out.
class Reader {
 public:
  Reader(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  const std::uint8_t* take(std::size_t size) {
    if (size > left_) {
      throw std::runtime_error("index of places: got " + std::to_string(left_) + " bytes, wanted " +
                               std::to_string(size) + " more");
    }
    const std::uint8_t* const here = data_;
    data_ += size, left_ -= size;
    return here;
  }
  std::uint32_t u32() {
    const std::uint8_t* const b = take(4);
    return b[0] | static_cast<std::uint32_t>(b[1]) << 8 | static_cast<std::uint32_t>(b[2]) << 16 |
           static_cast<std::uint32_t>(b[3]) << 24;
  }
  std::size_t left() const { return left_; }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

std::string keyText(const AtlasMap& map) {
  std::string text = map.name + ' ' + map.map_id;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      // Micrometres: a pose that came as a quaternion is the same pose.
      text += ' ' + std::to_string(std::llround(1e6 * map.T_atlas_map.matrix()(row, column)));
    }
  }
  return text;
}

}  // namespace

const char* const kPlaceIndexFile = "places.bin";

std::vector<std::uint32_t> placeKeys(const Atlas& atlas) {
  const auto neighbours = atlas.neighbours();
  std::vector<std::uint32_t> keys;
  for (std::size_t n = 0; n < atlas.maps.size(); ++n) {
    std::vector<std::string> around;
    for (const std::size_t m : neighbours[n]) around.push_back(keyText(atlas.maps[m]));
    std::sort(around.begin(), around.end());
    std::string text = keyText(atlas.maps[n]);
    for (const std::string& one : around) text += '\n' + one;
    keys.push_back(crcOf(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  }
  return keys;
}

std::vector<std::uint8_t> serialize(const PlaceIndex& index) {
  std::vector<std::uint8_t> bytes(kMagic, kMagic + kMagicBytes);
  put(bytes, static_cast<std::uint32_t>(index.maps().size()));
  for (const PlaceIndex::Entry& map : index.maps()) {
    put(bytes, static_cast<std::uint32_t>(map.name.size()));
    bytes.insert(bytes.end(), map.name.begin(), map.name.end());
    put(bytes, map.key);
    put(bytes, static_cast<std::uint32_t>(map.places.size()));
    for (const IndexedPlace& place : map.places) {
      bytes.insert(bytes.end(), place.ranges.begin(), place.ranges.end());
      for (const std::uint16_t steps : place.at) {
        bytes.push_back(static_cast<std::uint8_t>(steps));
        bytes.push_back(static_cast<std::uint8_t>(steps >> 8));
      }
    }
  }
  put(bytes, crcOf(bytes.data(), bytes.size()));
  return bytes;
}

PlaceIndex deserializePlaces(const std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < kMagicBytes + kCrcBytes || std::memcmp(bytes.data(), kMagic, kMagicBytes) != 0)
    throw std::runtime_error("index of places: got another file, wanted one that begins with 'TTSDFPL3'");
  const std::size_t body = bytes.size() - kCrcBytes;
  if (crcOf(bytes.data(), body) != Reader(bytes.data() + body, kCrcBytes).u32())
    throw std::runtime_error("index of places: got a damaged file, wanted its checksum (make it again)");
  Reader reader(bytes.data() + kMagicBytes, body - kMagicBytes);
  PlaceIndex index;
  const std::uint32_t count = reader.u32();
  for (std::uint32_t n = 0; n < count; ++n) {
    PlaceIndex::Entry map;
    const std::uint32_t length = reader.u32();
    const auto* const name = reinterpret_cast<const char*>(reader.take(length));
    map.name.assign(name, length);
    map.key = reader.u32();
    const std::uint32_t places = reader.u32();
    const std::uint8_t* next = reader.take(std::size_t{places} * kPlaceBytes);
    map.places.resize(places);
    for (IndexedPlace& place : map.places) {
      std::copy(next, next + place.ranges.size(), place.ranges.begin());
      next += place.ranges.size();
      for (std::uint16_t& steps : place.at) {
        steps = static_cast<std::uint16_t>(next[0] | next[1] << 8);
        next += 2;
      }
    }
    index.put(std::move(map));
  }
  if (reader.left() > 0) throw std::runtime_error("index of places: got bytes after the last map");
  return index;
}

PlaceIndex fittingPlaces(const PlaceIndex& index, const Atlas& atlas) {
  PlaceIndex fitting;
  const std::vector<std::uint32_t> keys = placeKeys(atlas);
  for (std::size_t n = 0; n < atlas.maps.size(); ++n) {
    const PlaceIndex::Entry* const map = index.find(atlas.maps[n].name);
    if (map && map->key == keys[n]) fitting.put(*map);
  }
  return fitting;
}

PlaceIndex readPlaceIndex(const std::string& folder, const Atlas& atlas) {
  const std::string path = (std::filesystem::path(folder) / kPlaceIndexFile).string();
  if (!std::filesystem::exists(path)) return PlaceIndex();
  try {
    return fittingPlaces(deserializePlaces(readFile(path)), atlas);
  } catch (const std::exception& error) {
    throw std::runtime_error("'" + path + "': " + error.what());
  }
}

void writePlaceIndex(const PlaceIndex& index, const std::string& folder) {
  writeFileAtomically((std::filesystem::path(folder) / kPlaceIndexFile).string(), serialize(index),
                      FileKind{"an index of places", kAnyVersion});
}

}  // namespace ttsdf

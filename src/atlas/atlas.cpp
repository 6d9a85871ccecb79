#include "ttsdf_localization/atlas/atlas.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <stdexcept>

#include "ttsdf_localization/atlas/box_tree.h"

namespace ttsdf {

namespace {

constexpr std::size_t kLongestName = 64, kLongestFile = 256;

bool plainName(const std::string& name) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  return !name.empty() && name.size() <= kLongestName && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), plain);
}

/// Whether a file name stays below its folder, by its text alone.
bool staysBelow(const std::string& file) {
  const std::filesystem::path path(file);
  const auto printable = [](char c) { return static_cast<unsigned char>(c) >= 0x20 && c != 0x7f; };
  return !file.empty() && file.size() <= kLongestFile && path.is_relative() && path.has_filename() &&
         std::find(path.begin(), path.end(), "..") == path.end() &&
         std::all_of(file.begin(), file.end(), printable);
}

bool rigid(const Eigen::Isometry3d& T) {
  const Eigen::Matrix3d R = T.linear();
  return T.matrix().allFinite() &&
         (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-6 &&
         R.determinant() > 0.0;
}

void checkMap(const AtlasMap& map) {
  const auto refuse = [&map](const std::string& what) {
    throw std::invalid_argument("atlas: map '" + map.name + "': " + what);
  };
  if (!plainName(map.name)) {
    refuse("got this name, wanted 1 to 64 letters, digits, '_', '-' or '.', not beginning with '.'");
  }
  if (!staysBelow(map.file)) {
    refuse("got the file '" + map.file + "', wanted one below the atlas' folder, without '..'");
  }
  if (map.map_id.size() != 8 || map.map_id.find_first_not_of("0123456789abcdef") != std::string::npos) {
    refuse("got the id '" + map.map_id + "', wanted 8 hexadecimal digits");
  }
  if (map.version < 1) refuse("got version " + std::to_string(map.version) + ", wanted 1 or more");
  if (!rigid(map.T_atlas_map) || !rigid(map.T_map_box)) refuse("wanted poses that are rigid motions");
  if (!map.size.allFinite() || !(map.size.minCoeff() >= 0.0)) refuse("wanted a box of a size of 0 or more");
  if (!std::isfinite(map.voxel_size) || !(map.voxel_size > 0.0)) refuse("wanted a voxel size above 0");
}

void addFileProblems(const AtlasMap& map, const std::string& folder, const MapLimits& limits,
                     std::vector<std::string>& lines) {
  const auto say = [&](const std::string& what) { lines.push_back("map '" + map.name + "': " + what); };
  try {
    const AtlasMap file = describeMap(map.name, map.file, readFile(mapPath(folder, map)), limits);
    if (file.map_id != map.map_id) {
      say("got a file with id " + file.map_id + ", wanted " + map.map_id + " (replace it, or add it anew)");
    } else if (file.bytes != map.bytes) {
      say("got " + std::to_string(file.bytes) + " bytes, wanted " + std::to_string(map.bytes));
    }
    const double corner = (file.T_map_box.matrix() - map.T_map_box.matrix()).cwiseAbs().maxCoeff();
    if (corner > 1e-3 || (file.size - map.size).cwiseAbs().maxCoeff() > 1e-3) {
      say("the file covers another box than atlas.yaml says (add it anew)");
    }
  } catch (const std::exception& error) {
    say(error.what());
  }
}

}  // namespace

const char* const kAtlasFile = "atlas.yaml";

const AtlasMap* Atlas::find(const std::string& name) const {
  const auto found =
      std::find_if(maps.begin(), maps.end(), [&name](const AtlasMap& map) { return map.name == name; });
  return found == maps.end() ? nullptr : &*found;
}

std::vector<std::vector<std::size_t>> Atlas::neighbours(double overlap) const {
  std::vector<OrientedBox> boxes;
  std::vector<Eigen::AlignedBox3d> bounds;
  for (const AtlasMap& map : maps) {
    boxes.push_back(map.box());
    bounds.push_back(boxes.back().bounds());
  }
  const BoxTree tree(bounds);
  std::vector<std::vector<std::size_t>> lists(maps.size());
  for (std::size_t n = 0; n < maps.size(); ++n) {
    for (const std::size_t m : tree.within(bounds[n], 0.0)) {
      const double depth = m == n ? 0.0 : overlapDepth(boxes[n], boxes[m]);
      if (depth > 0.0 && depth >= overlap) lists[n].push_back(m);
    }
  }
  return lists;
}

void check(const Atlas& atlas) {
  std::set<std::string> names, files;
  for (const AtlasMap& map : atlas.maps) {
    checkMap(map);
    if (!names.insert(map.name).second) {
      throw std::invalid_argument("atlas: got two maps with the name '" + map.name + "', wanted one");
    }
    if (!files.insert(std::filesystem::path(map.file).lexically_normal().string()).second) {
      throw std::invalid_argument("atlas: got two maps with the file '" + map.file + "', wanted one");
    }
  }
}

std::string mapPath(const std::string& folder, const AtlasMap& map) {
  // The folder itself may be named in any way, '..' included; the map's file may not.
  const std::filesystem::path home = std::filesystem::weakly_canonical(folder);
  return pathInFolder("map '" + map.name + "'", (home / map.file).string(), home.string());
}

MapBytes mapFilesIn(const std::string& folder) {
  return [folder](const AtlasMap& map) {
    const std::string path = mapPath(folder, map);
    if (!std::filesystem::exists(path)) throw MapFormatError("cannot open '" + path + "': no such file");
    return readFile(path);
  };
}

AtlasMap describeMap(const std::string& name, const std::string& file, const std::vector<std::uint8_t>& bytes,
                     const MapLimits& limits) {
  const MapFileInfo info = fileInfo(bytes.data(), bytes.size());
  const TtSdfMap map = deserialize(bytes.data(), bytes.size(), limits);
  AtlasMap result;
  result.name = name;
  result.file = file;
  result.map_id = info.map_id;
  result.bytes = info.file_bytes;
  result.voxel_size = map.geometry.voxel_size;
  result.T_map_box = map.geometry.T_map_grid;
  result.size = map.geometry.voxel_size * (map.geometry.dims - 1).cast<double>().matrix();
  return result;
}

std::vector<std::string> problems(const Atlas& atlas, const std::string& folder, const MapLimits& limits) {
  std::vector<std::string> lines;
  for (const AtlasMap& map : atlas.maps) addFileProblems(map, folder, limits, lines);
  const auto neighbours = atlas.neighbours();
  for (std::size_t n = 0; n < atlas.maps.size() && atlas.maps.size() > 1; ++n) {
    if (neighbours[n].empty())
      lines.push_back("map '" + atlas.maps[n].name + "': overlaps with no other map");
  }
  return lines;
}

}  // namespace ttsdf

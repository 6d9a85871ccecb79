// atlas.yaml: reading and writing.

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <stdexcept>

#include "freed_memory.h"
#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/options/option_table.h"
#include "ttsdf_localization/yaml/plain_yaml.h"

namespace ttsdf {

namespace {

constexpr int kForm = 1;  // of atlas.yaml

/// Begins the message of everything that is wrong at one place of the file.
struct Place {
  std::string text;
  [[noreturn]] void refuse(const std::string& what) const { throw std::runtime_error(text + ": " + what); }
};

template <class T>
T valueOf(const YAML::Node& node, const std::string& key, const std::string& wanted, const Place& place) {
  const YAML::Node value = node[key];
  if (!value) place.refuse("'" + key + "' is missing, wanted " + wanted);
  try {
    return value.as<T>();
  } catch (const YAML::Exception&) {
    place.refuse("'" + key + "': wanted " + wanted);
  }
}

template <int N>
Eigen::Matrix<double, N, 1> numbersIn(const YAML::Node& value, const Place& place) {
  std::vector<double> list;
  try {
    list = value.as<std::vector<double>>();
  } catch (const YAML::Exception&) {
    place.refuse("wanted " + std::to_string(N) + " numbers");
  }
  if (list.size() != static_cast<std::size_t>(N))
    place.refuse("got " + std::to_string(list.size()) + " numbers, wanted " + std::to_string(N));
  Eigen::Matrix<double, N, 1> numbers;
  for (int n = 0; n < N; ++n) numbers[n] = list[static_cast<std::size_t>(n)];
  if (!numbers.allFinite()) place.refuse("wanted finite numbers");
  return numbers;
}

template <int N>
Eigen::Matrix<double, N, 1> numbersOf(const YAML::Node& node, const std::string& key, const Place& place) {
  if (!node[key]) place.refuse("'" + key + "' is missing, wanted " + std::to_string(N) + " numbers");
  return numbersIn<N>(node[key], {place.text + ", '" + key + "'"});
}

Eigen::Isometry3d poseOf(const YAML::Node& node, const Place& place) {
  if (!node || !node.IsMap()) place.refuse("wanted position: [x, y, z] and orientation: [x, y, z, w]");
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = numbersOf<3>(node, "position", place);
  const Eigen::Vector4d q = numbersOf<4>(node, "orientation", place);
  if (std::abs(q.norm() - 1.0) > 1e-3) {
    place.refuse("'orientation': got a quaternion of length " + toString(q.norm()) + ", wanted 1");
  }
  T.linear() = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
  return T;
}

AtlasMap mapOf(const YAML::Node& node, const Place& list) {
  if (!node.IsMap()) list.refuse("wanted a list of maps, each with name, file, id, bytes, pose and box");
  AtlasMap map;
  map.name = valueOf<std::string>(node, "name", "a text", list);
  const Place place{list.text + " '" + map.name + "'"};
  map.file = valueOf<std::string>(node, "file", "a text", place);
  map.map_id = valueOf<std::string>(node, "id", "8 hexadecimal digits", place);
  map.bytes = valueOf<std::size_t>(node, "bytes", "a whole number", place);
  map.version = node["version"] ? valueOf<int>(node, "version", "a whole number", place) : 1;
  map.voxel_size = valueOf<double>(node, "voxel_size", "a number [m]", place);
  map.T_atlas_map = poseOf(node["pose"], {place.text + ", pose"});
  map.T_map_box = poseOf(node["box"], {place.text + ", box"});
  map.size = numbersOf<3>(node["box"], "size", {place.text + ", box"});
  return map;
}

Atlas fromOwnForm(const YAML::Node& root, const AtlasLimits& limits, const Place& file) {
  const int form = valueOf<int>(root, "atlas", "the version of this form", file);
  if (form != kForm) {
    file.refuse("got version " + std::to_string(form) + " of this form, wanted " + std::to_string(kForm));
  }
  Atlas atlas;
  if (root["frame_id"]) atlas.frame_id = valueOf<std::string>(root, "frame_id", "a text", file);
  const YAML::Node maps = root["maps"];
  if (!maps || !(maps.IsSequence() || maps.IsNull())) file.refuse("'maps': wanted a list");
  if (maps.size() > limits.max_maps) {
    file.refuse("got " + std::to_string(maps.size()) + " maps, wanted at most " +
                std::to_string(limits.max_maps));
  }
  for (const YAML::Node& map : maps) atlas.maps.push_back(mapOf(map, {file.text + ": map"}));
  return atlas;
}

/// Autoware's: FILE: [x, y], the low corner of a cell of x_resolution x y_resolution; one frame for all.
Atlas fromGridForm(const YAML::Node& root, const std::string& folder, const AtlasLimits& limits,
                   const Place& file) {
  const Eigen::Vector2d cell(valueOf<double>(root, "x_resolution", "a number [m]", file),
                             valueOf<double>(root, "y_resolution", "a number [m]", file));
  if (!(cell.minCoeff() > 0.0) || !cell.allFinite()) file.refuse("wanted resolutions above 0");
  if (root.size() > limits.max_maps + 2) {
    file.refuse("got " + std::to_string(root.size() - 2) + " maps, wanted at most " +
                std::to_string(limits.max_maps));
  }
  Atlas atlas;
  for (const auto& entry : root) {
    const auto name = entry.first.as<std::string>();
    if (name == "x_resolution" || name == "y_resolution") continue;
    const Place place{file.text + ": map '" + name + "'"};
    const Eigen::Vector2d low = numbersIn<2>(entry.second, place);
    AtlasMap map;
    map.name = std::filesystem::path(name).stem().string();
    map.file = name;
    try {
      map = describeMap(map.name, name, readFile(mapPath(folder, map)));
    } catch (const std::exception& error) {
      place.refuse(error.what());
    }
    Eigen::AlignedBox3d bounds = map.box().bounds();
    bounds.min().z() = bounds.max().z() = 0.0;
    const Eigen::AlignedBox3d wanted(Eigen::Vector3d(low.x(), low.y(), 0.0),
                                     Eigen::Vector3d(low.x() + cell.x(), low.y() + cell.y(), 0.0));
    if (!bounds.intersects(wanted)) place.refuse("its box lies outside of the cell that the file gives it");
    atlas.maps.push_back(std::move(map));
  }
  return atlas;
}

std::string list(const Eigen::Ref<const Eigen::VectorXd>& numbers) {
  std::string text = "[";
  for (Eigen::Index n = 0; n < numbers.size(); ++n) text += (n > 0 ? ", " : "") + toString(numbers[n]);
  return text + "]";
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + "\"";
}

std::string pose(const Eigen::Isometry3d& T) {
  Eigen::Quaterniond q(T.linear());
  if (q.w() < 0.0) q.coeffs() *= -1.0;  // one text for one pose
  return "position: " + list(T.translation()) + ", orientation: " + list(q.coeffs());
}

}  // namespace

std::string toYaml(const Atlas& atlas) {
  std::ostringstream out;
  out << "# An atlas of maps (doc/atlas.md). Lengths in metres, orientations x y z w.\n"
      << "atlas: " << kForm << "\nframe_id: " << quoted(atlas.frame_id) << "\nmaps:\n";
  for (const AtlasMap& map : atlas.maps) {
    out << "  - name: " << quoted(map.name) << "\n    file: " << quoted(map.file)
        << "\n    id: " << quoted(map.map_id) << "\n    bytes: " << map.bytes
        << "\n    version: " << map.version << "\n    voxel_size: " << toString(map.voxel_size)
        << "\n    pose: {" << pose(map.T_atlas_map) << "}\n    box: {" << pose(map.T_map_box)
        << ", size: " << list(map.size) << "}\n";
  }
  return out.str();
}

namespace {

Atlas parseAtlas(const std::string& path, const std::string& home, const AtlasLimits& limits,
                 const Place& place) {
  const YAML::Node root = loadPlainYaml("atlas", path, limits.max_file_bytes);
  if (!root.IsMap())
    place.refuse("wanted 'atlas', 'frame_id' and 'maps', or 'x_resolution' and 'y_resolution'");
  return root["x_resolution"] ? fromGridForm(root, home, limits, place) : fromOwnForm(root, limits, place);
}

}  // namespace

Atlas readAtlas(const std::string& folder, const AtlasLimits& limits) {
  namespace fs = std::filesystem;
  const bool is_file = fs::is_regular_file(folder);
  const std::string path = is_file ? folder : (fs::path(folder) / kAtlasFile).string();
  const std::string home = is_file ? fs::absolute(folder).parent_path().string() : folder;
  const Place place{"atlas '" + path + "'"};
  const Atlas atlas = parseAtlas(path, home, limits, place);
  constexpr std::size_t kMany = 200;  // maps; the parsed text of one takes 25 kB
  if (atlas.maps.size() >= kMany) releaseFreedMemory();
  try {
    check(atlas);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(place.text + ": " + error.what());
  }
  return atlas;
}

void writeAtlas(const Atlas& atlas, const std::string& folder) {
  check(atlas);
  OutputFile file((std::filesystem::path(folder) / kAtlasFile).string());
  file.stream() << toYaml(atlas);
  file.close();
}

}  // namespace ttsdf

// add, remove, merge, rollback.

#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>
#include <stdexcept>

#include "atlas_commands.h"
#include "atlas_versions.h"
#include "ttsdf_localization/tools/command_line.h"

namespace ttsdf {

namespace {

namespace fs = std::filesystem;

/// An empty atlas where there is none yet.
Atlas readOrBegin(const std::string& folder) {
  if (fs::exists(fs::path(folder) / kAtlasFile)) return readAtlas(folder);
  if (!fs::is_directory(folder)) throw std::runtime_error("'" + folder + "': no such folder");
  return {};
}

void warn(const std::string& text) {
  if (!text.empty()) std::cerr << "ttsdf_atlas: warning: " << text << '\n';
}

/// The last version that is not what the map's file holds now; null if none is kept.
std::optional<AtlasMap> lastOther(const std::string& folder, const std::string& name,
                                  const std::string& id_now) {
  const std::vector<int> kept = keptVersions(folder, name);
  for (auto version = kept.rbegin(); version != kept.rend(); ++version) {
    AtlasMap map = keptVersion(folder, name, *version);
    if (map.map_id != id_now) return map;
  }
  return std::nullopt;
}

}  // namespace

Eigen::Isometry3d poseFromText(const std::string& flag, const std::string& text) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (text.empty()) return T;
  const std::vector<double> n = parseNumberList(flag, text);
  if (n.size() != 3 && n.size() != 7) {
    throw UsageError("--" + flag + ": got " + std::to_string(n.size()) +
                     " numbers, wanted x,y,z or x,y,z,qx,qy,qz,qw");
  }
  T.translation() << n[0], n[1], n[2];
  if (n.size() == 7) {
    const Eigen::Quaterniond q(n[6], n[3], n[4], n[5]);
    if (!(std::abs(q.norm() - 1.0) < 1e-3)) {
      throw UsageError("--" + flag + ": got a quaternion of length " + std::to_string(q.norm()) +
                       ", wanted 1");
    }
    T.linear() = q.normalized().toRotationMatrix();
  }
  return T;
}

std::string putMap(Atlas& atlas, const std::string& folder, AtlasMap entry,
                   const std::vector<std::uint8_t>& bytes) {
  Atlas next = atlas;
  auto place = next.maps.end();
  for (auto it = next.maps.begin(); it != next.maps.end(); ++it) {
    if (it->name == entry.name) place = it;
  }
  if (place == next.maps.end()) {
    next.maps.push_back(entry);
  } else {
    entry.version = place->version + (place->map_id == entry.map_id ? 0 : 1);
    entry.file = place->file;
    *place = entry;
  }
  check(next);
  const AtlasMap* const before = atlas.find(entry.name);
  std::string not_kept;
  if (before && before->map_id != entry.map_id) not_kept = keepVersion(folder, *before);
  const AtlasMap& now = *next.find(entry.name);
  writeFileAtomically(mapPath(folder, now), bytes, kMapFile);
  atlas = std::move(next);
  return not_kept;
}

int runAtlasAdd(int argc, char** argv) {
  std::string folder, file, name, pose;
  bool replace = false;
  CommandLine line(
      "ttsdf_atlas add", "FOLDER MAP.ttsdf [options]",
      "Copies a map into the folder and writes it into atlas.yaml, which is made if there is none.");
  line.positional("FOLDER", folder)
      .positional("MAP.ttsdf", file)
      .value("name", "NAME", name, "Its name; by default that of the file.")
      .value("pose", "X,Y,Z[,QX,QY,QZ,QW]", pose,
             "Pose of the map in the atlas; by default its frame is the atlas'.")
      .flag("replace", replace,
            "Puts the map in the place of the one of this name: the next version. Its pose stays without "
            "--pose.");
  if (!line.parse(argc, argv, std::cout)) return 0;
  Atlas atlas = readOrBegin(folder);
  if (name.empty()) name = fs::path(file).stem().string();
  const AtlasMap* const old = atlas.find(name);
  if (old && !replace) {
    throw std::runtime_error("'" + folder + "': there is a map '" + name + "' already (--replace)");
  }
  if (!old && replace) throw std::runtime_error("'" + folder + "': got no map '" + name + "' to replace");
  const std::vector<std::uint8_t> bytes = readFile(file);
  AtlasMap entry;
  try {
    entry = describeMap(name, name + ".ttsdf", bytes);
  } catch (const MapFormatError& error) {
    throw std::runtime_error("'" + file + "': " + error.what());
  }
  entry.T_atlas_map = old && pose.empty() ? old->T_atlas_map : poseFromText("pose", pose);
  warn(putMap(atlas, folder, entry, bytes));
  writeAtlas(atlas, folder);
  const AtlasMap& put = *atlas.find(name);
  std::cout << "map '" << name << "', version " << put.version << ", id " << put.map_id << ": " << put.bytes
            << " bytes\n";
  return 0;
}

int runAtlasRemove(int argc, char** argv) {
  std::string folder;
  std::vector<std::string> names;
  bool keep_files = false;
  CommandLine line("ttsdf_atlas remove", "FOLDER NAME... [options]", "Takes maps out of the atlas.");
  line.positional("FOLDER", folder)
      .positionals("NAME", names)
      .flag("keep-files", keep_files, "Leaves the map files.");
  if (!line.parse(argc, argv, std::cout)) return 0;
  Atlas atlas = readAtlas(folder);
  std::vector<std::string> files;
  for (const std::string& name : names) {
    const AtlasMap* const map = atlas.find(name);
    if (!map) throw std::runtime_error("'" + folder + "': got no map '" + name + "' (info lists them)");
    files.push_back(mapPath(folder, *map));
    atlas.maps.erase(atlas.maps.begin() + (map - atlas.maps.data()));
  }
  writeAtlas(atlas, folder);  // first: a file that no atlas names does no harm
  for (const std::string& file : files) {
    if (!keep_files) fs::remove(file);
  }
  for (const std::string& name : names) {
    if (!keep_files) dropVersions(folder, name);
  }
  return 0;
}

int runAtlasRollback(int argc, char** argv) {
  std::string folder, name;
  int version = 0;
  CommandLine line("ttsdf_atlas rollback", "FOLDER NAME [options]",
                   "Makes a map what it was before. What it is now is kept, too: version numbers only rise.");
  line.positional("FOLDER", folder)
      .positional("NAME", name)
      .value("version", "N", version, "The version to go back to; by default the last one before this.");
  if (!line.parse(argc, argv, std::cout)) return 0;
  Atlas atlas = readAtlas(folder);
  const AtlasMap* const now = atlas.find(name);
  if (!now) throw std::runtime_error("'" + folder + "': got no map '" + name + "' (info lists them)");
  const std::string id_now = idOnDisk(folder, *now);  // atlas.yaml is older if an update was interrupted
  const auto chosen =
      version == 0 ? lastOther(folder, name, id_now) : std::optional(keptVersion(folder, name, version));
  if (!chosen)
    throw std::runtime_error("map '" + name + "': got version " + std::to_string(now->version) +
                             ", wanted one with an older version that is kept");
  const AtlasMap& old = *chosen;
  const std::vector<std::uint8_t> bytes = readFile(mapPath(folder, old));
  AtlasMap entry = describeMap(name, now->file, bytes);
  if (entry.map_id != old.map_id) {
    throw std::runtime_error("'" + old.file + "': got id " + entry.map_id + ", wanted " + old.map_id);
  }
  if (entry.map_id == id_now && entry.map_id == now->map_id) {
    throw std::runtime_error("map '" + name + "': version " + std::to_string(old.version) +
                             " is what it is now, wanted another one (--version)");
  }
  entry.T_atlas_map = old.T_atlas_map;
  warn(putMap(atlas, folder, entry, bytes));
  writeAtlas(atlas, folder);
  std::cout << "map '" << name << "': version " << atlas.find(name)->version << " is version " << old.version
            << " again, id " << entry.map_id << " (index makes places.bin anew)\n";
  return 0;
}

int runAtlasMerge(int argc, char** argv) {
  std::string folder, other_folder, pose, prefix;
  CommandLine line("ttsdf_atlas merge", "FOLDER OTHER [options]",
                   "Puts all maps of the atlas OTHER into the atlas FOLDER.");
  line.positional("FOLDER", folder)
      .positional("OTHER", other_folder)
      .value("pose", "X,Y,Z[,QX,QY,QZ,QW]", pose,
             "Pose of the other atlas in this one; by default they share a frame.")
      .value("prefix", "TEXT", prefix, "Put before the names of the other atlas' maps.");
  if (!line.parse(argc, argv, std::cout)) return 0;
  const Eigen::Isometry3d T_atlas_other = poseFromText("pose", pose);
  Atlas atlas = readOrBegin(folder);
  const Atlas other = readAtlas(other_folder);
  for (const AtlasMap& map : other.maps) {
    if (atlas.find(prefix + map.name)) {
      throw std::runtime_error("both atlases have a map '" + prefix + map.name + "' (--prefix)");
    }
  }
  for (const AtlasMap& map : other.maps) {
    AtlasMap entry = map;
    entry.name = prefix + map.name;
    entry.file = entry.name + ".ttsdf";
    entry.T_atlas_map = T_atlas_other * map.T_atlas_map;
    warn(putMap(atlas, folder, entry, readFile(mapPath(other_folder, map))));
  }
  writeAtlas(atlas, folder);
  std::cout << other.maps.size() << " maps added, " << atlas.maps.size() << " in all\n";
  return 0;
}

}  // namespace ttsdf

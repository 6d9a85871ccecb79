#pragma once
// An atlas: a folder of map files and one atlas.yaml that says what each is called and where it lies.

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "ttsdf_localization/atlas/oriented_box.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

struct AtlasMap {
  std::string name;         ///< letters, digits, '_', '-', '.'
  std::string file;         ///< below the atlas' folder
  std::string map_id;       ///< of the file (map/map_io.h)
  std::size_t bytes = 0;    ///< of the file
  int version = 1;          ///< rises each time the map is replaced
  double voxel_size = 0.0;  ///< [m]
  Eigen::Isometry3d T_atlas_map = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_map_box = Eigen::Isometry3d::Identity();  ///< corner and axes of the map's box
  Eigen::Vector3d size = Eigen::Vector3d::Zero();               ///< of the box [m]

  OrientedBox box() const { return {T_atlas_map * T_map_box, size}; }
};

struct Atlas {
  std::string frame_id = "map";
  std::vector<AtlasMap> maps;

  /// Null if there is none of this name.
  const AtlasMap* find(const std::string& name) const;
  /// Per map, the maps whose boxes overlap with it by at least `overlap` [m].
  std::vector<std::vector<std::size_t>> neighbours(double overlap = 0.0) const;
};

/// Of what a reader takes.
struct AtlasLimits {
  std::size_t max_file_bytes = std::size_t{32} << 20;  ///< of atlas.yaml
  std::size_t max_maps = 50000;
};

extern const char* const kAtlasFile;  ///< "atlas.yaml"

/// Names, files, poses and sizes are usable, and no name and no file is there twice. Throws
/// std::invalid_argument.
void check(const Atlas& atlas);

/// Reads atlas.yaml of a folder, or the file itself. Autoware's form (x_resolution, y_resolution, FILE: [x,
/// y]) is read as well: maps of one frame, whose boxes are then taken from the map files. Map files are not
/// opened otherwise. Throws std::runtime_error naming the file and the map.
Atlas readAtlas(const std::string& folder, const AtlasLimits& limits = {});
/// Checks, and replaces atlas.yaml as files/file_writer.h has it.
void writeAtlas(const Atlas& atlas, const std::string& folder);
/// The text of atlas.yaml; equal atlases, equal texts.
std::string toYaml(const Atlas& atlas);

/// The map's file, links followed. Throws std::invalid_argument if it leads out of the folder.
std::string mapPath(const std::string& folder, const AtlasMap& map);

/// Gives the bytes of a map's file; throws std::runtime_error. Whoever asks checks that they are the map's.
using MapBytes = std::function<std::vector<std::uint8_t>(const AtlasMap& map)>;
/// Those of the files in a folder.
MapBytes mapFilesIn(const std::string& folder);

/// What atlas.yaml says of a map file. Throws MapFormatError.
AtlasMap describeMap(const std::string& name, const std::string& file, const std::vector<std::uint8_t>& bytes,
                     const MapLimits& limits = {});

/// What is wrong with the map files of an atlas, a line each: missing, damaged, another id, another box, no
/// neighbour where there are several maps. Reads every file.
std::vector<std::string> problems(const Atlas& atlas, const std::string& folder,
                                  const MapLimits& limits = {});

}  // namespace ttsdf

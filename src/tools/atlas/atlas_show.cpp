// info, check, export.

#include <iomanip>
#include <iostream>
#include <stdexcept>

#include "atlas_commands.h"
#include "ttsdf_localization/exports/exports.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/json_file.h"

namespace ttsdf {

namespace {

Json::Value numbers(const Eigen::Ref<const Eigen::VectorXd>& values) {
  Json::Value list(Json::arrayValue);
  for (const double value : std::vector<double>(values.data(), values.data() + values.size()))
    list.append(value);
  return list;
}

Json::Value describe(const Atlas& atlas) {
  Json::Value root;
  root["frame_id"] = atlas.frame_id;
  root["maps"] = Json::arrayValue;
  const auto neighbours = atlas.neighbours();
  for (std::size_t n = 0; n < atlas.maps.size(); ++n) {
    const AtlasMap& map = atlas.maps[n];
    Json::Value entry;
    entry["name"] = map.name;
    entry["file"] = map.file;
    entry["id"] = map.map_id;
    entry["bytes"] = static_cast<Json::UInt64>(map.bytes);
    entry["version"] = map.version;
    entry["voxel_size"] = map.voxel_size;
    entry["position"] = numbers(map.T_atlas_map.translation());
    entry["orientation_xyzw"] = numbers(Eigen::Quaterniond(map.T_atlas_map.linear()).coeffs());
    entry["centre"] = numbers(map.box().centre());
    entry["size"] = numbers(map.size);
    entry["neighbours"] = Json::arrayValue;
    for (const std::size_t m : neighbours[n]) entry["neighbours"].append(atlas.maps[m].name);
    root["maps"].append(entry);
  }
  return root;
}

void printTable(const Atlas& atlas) {
  const auto neighbours = atlas.neighbours();
  std::size_t bytes = 0;
  Eigen::AlignedBox3d all;
  for (std::size_t n = 0; n < atlas.maps.size(); ++n) {
    const AtlasMap& map = atlas.maps[n];
    bytes += map.bytes;
    all.extend(map.box().bounds());
    std::cout << map.name << "  " << map.map_id << "  version " << map.version << "  " << map.bytes
              << " bytes  " << std::fixed << std::setprecision(1) << map.size.transpose() << " m at "
              << map.box().centre().transpose() << "  beside";
    for (const std::size_t m : neighbours[n]) std::cout << ' ' << atlas.maps[m].name;
    std::cout << (neighbours[n].empty() ? " none\n" : "\n");
  }
  std::cout << atlas.maps.size() << " maps, " << bytes << " bytes";
  if (!atlas.maps.empty())
    std::cout << ", " << std::fixed << std::setprecision(1) << all.sizes().transpose() << " m";
  std::cout << '\n';
}

/// Which map answers for a place: the one whose border is furthest.
std::size_t deepest(const std::vector<OrientedBox>& boxes, const Eigen::Vector3d& p) {
  std::size_t best = 0;
  for (std::size_t n = 1; n < boxes.size(); ++n) {
    if (boxes[n].depth(p) > boxes[best].depth(p)) best = n;
  }
  return best;
}

/// Adds the triangles that this map answers for, in the atlas' frame.
void addSurface(const SurfaceMesh& mesh, std::size_t map, const Atlas& atlas,
                const std::vector<OrientedBox>& boxes, SurfaceMesh& all) {
  const Eigen::Isometry3d& T = atlas.maps[map].T_atlas_map;
  const Eigen::Index before = all.vertices.cols();
  Eigen::Matrix3Xd vertices = mesh.vertices.cast<double>().colwise() + mesh.origin;
  vertices = (T.linear() * vertices).colwise() + T.translation();
  std::vector<Eigen::Vector3i> kept;
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    const Eigen::Vector3i t = mesh.triangles.col(n);
    const Eigen::Vector3d middle = (vertices.col(t[0]) + vertices.col(t[1]) + vertices.col(t[2])) / 3.0;
    if (deepest(boxes, middle) == map) kept.emplace_back(t.array() + static_cast<int>(before));
  }
  all.vertices.conservativeResize(3, before + vertices.cols());
  all.vertices.rightCols(vertices.cols()) = (vertices.colwise() - all.origin).cast<float>();
  const Eigen::Index first = all.triangles.cols();
  all.triangles.conservativeResize(3, first + static_cast<Eigen::Index>(kept.size()));
  for (std::size_t n = 0; n < kept.size(); ++n)
    all.triangles.col(first + static_cast<Eigen::Index>(n)) = kept[n];
}

}  // namespace

int runAtlasInfo(int argc, char** argv) {
  std::string folder;
  bool json = false;
  CommandLine line("ttsdf_atlas info", "FOLDER [options]", "Lists the maps and their neighbours.");
  line.positional("FOLDER", folder).flag("json", json, "Prints JSON.");
  if (!line.parse(argc, argv, std::cout)) return 0;
  const Atlas atlas = readAtlas(folder);
  if (json) {
    std::cout << toText(describe(atlas));
  } else {
    printTable(atlas);
  }
  return 0;
}

int runAtlasCheck(int argc, char** argv) {
  std::string folder;
  CommandLine line("ttsdf_atlas check", "FOLDER", "Reads every map file and compares it with atlas.yaml.");
  line.positional("FOLDER", folder);
  if (!line.parse(argc, argv, std::cout)) return 0;
  const Atlas atlas = readAtlas(folder);
  const std::vector<std::string> lines = problems(atlas, folder);
  for (const std::string& text : lines) std::cout << text << '\n';
  if (!lines.empty()) {
    throw std::runtime_error("'" + folder + "': got " + std::to_string(lines.size()) +
                             " problems, wanted none");
  }
  std::cout << atlas.maps.size() << " maps, all as atlas.yaml says\n";
  return 0;
}

int runAtlasExport(int argc, char** argv) {
  std::string folder, surface;
  CommandLine line("ttsdf_atlas export", "FOLDER --surface FILE",
                   "Writes the surface of all maps as one mesh; where maps overlap, that of the map whose "
                   "border is furthest.");
  line.positional("FOLDER", folder).value("surface", "FILE", surface, "The mesh: .ply, .obj or .stl.");
  if (!line.parse(argc, argv, std::cout)) return 0;
  if (surface.empty()) throw UsageError("--surface is missing");
  const Atlas atlas = readAtlas(folder);
  std::vector<OrientedBox> boxes;
  SurfaceMesh all;
  for (const AtlasMap& map : atlas.maps) boxes.push_back(map.box());
  if (!boxes.empty() && boxes.front().centre().cwiseAbs().maxCoeff() > 1000.0) {
    all.origin = boxes.front().centre().array().round();
  }
  for (std::size_t n = 0; n < atlas.maps.size(); ++n) {
    addSurface(extractSurface(loadMap(mapPath(folder, atlas.maps[n]))), n, atlas, boxes, all);
  }
  writeSurface(all, surface);
  std::cout << all.vertices.cols() << " vertices, " << all.triangles.cols() << " triangles\n";
  return 0;
}

}  // namespace ttsdf

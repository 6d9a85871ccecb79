// From a compressed map to files of other programs.

#include <iostream>
#include <string>
#include <vector>

#include "ttsdf_localization/exports/exports.h"
#include "ttsdf_localization/exports/occupancy.h"
#include "ttsdf_localization/files/file_writer.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/progress.h"

namespace {

struct Arguments {
  std::string map, surface, cloud, vdb, occupancy, octomap, slice;
  double height = 0.0, resolution = 0.0, min_height = -1e9, max_height = 1e9;
};

/// The map counts as well: a link could lead to it.
void refuseSameFiles(const Arguments& a) {
  struct File {
    const char* flag;
    std::string path, target;
  };
  std::vector<File> files;
  const auto add = [&files](const char* flag, const std::string& path) {
    if (path.empty()) return;
    const std::string target = ttsdf::targetOf(path);
    for (const File& other : files) {
      if (other.target != target) continue;
      throw ttsdf::UsageError("got '" + other.path + "' for " + other.flag + " and '" + path + "' for " +
                              flag + ", wanted a file of its own for each");
    }
    files.push_back({flag, path, target});
  };
  add("MAP.ttsdf", a.map);
  add("--surface", a.surface);
  add("--cloud", a.cloud);
  add("--vdb", a.vdb);
  add("--octomap", a.octomap);
  add("--slice", a.slice);
  if (a.occupancy.empty()) return;
  const ttsdf::OccupancyFiles occupancy = ttsdf::occupancyFiles(a.occupancy);
  add("--occupancy", occupancy.image);
  add("--occupancy", occupancy.yaml);
}

int run(int argc, char** argv) {
  Arguments a;
  ttsdf::CommandLine line(
      "ttsdf_export",
      "MAP.ttsdf [--surface FILE] [--cloud FILE] [--vdb FILE] [--occupancy NAME] [--octomap FILE.bt] "
      "[--slice FILE --height Z]",
      "Writes what a map holds in the formats of other programs, in the map's frame [m].");
  line.positional("MAP.ttsdf", a.map)
      .value("surface", "FILE", a.surface, "The surface as a mesh: .ply, .obj or .stl.")
      .value("cloud", "FILE", a.cloud, "Points of the surface with normals: .pcd or .ply.")
      .value("vdb", "FILE", a.vdb, "The distances as a grid of OpenVDB.")
      .value("occupancy", "NAME", a.occupancy, "NAME.pgm and NAME.yaml for map_server.")
      .value("octomap", "FILE.bt", a.octomap, "Occupied and free cells as a binary octree.")
      .value("slice", "FILE", a.slice, "Distances at --height: .csv or .pgm.")
      .value("height", "Z", a.height, "Of the slice [m].")
      .value("resolution", "R", a.resolution,
             "Edge of the cells of occupancy and octomap [m]; 0: the map's voxel size.")
      .value("min-height", "Z", a.min_height, "Obstacles of the occupancy grid count from here [m].")
      .value("max-height", "Z", a.max_height, "... up to here [m].");
  if (!line.parse(argc, argv, std::cout)) return 0;
  if (a.surface.empty() && a.cloud.empty() && a.vdb.empty() && a.occupancy.empty() && a.octomap.empty() &&
      a.slice.empty()) {
    throw ttsdf::UsageError(
        "got nothing to write, wanted --surface, --cloud, --vdb, --occupancy, --octomap or --slice");
  }
  refuseSameFiles(a);
  ttsdf::Progress progress("ttsdf_export");
  const ttsdf::TtSdfMap map = ttsdf::loadMap(a.map);
  progress.update("surface", 0.0);
  if (!a.surface.empty() || !a.cloud.empty()) {
    const ttsdf::SurfaceMesh mesh = ttsdf::extractSurface(map);
    if (!a.surface.empty()) ttsdf::writeSurface(mesh, a.surface);
    if (!a.cloud.empty()) ttsdf::writeSurfaceCloud(mesh, a.cloud);
    std::cout << mesh.vertices.cols() << " vertices, " << mesh.triangles.cols() << " triangles\n";
  }
  progress.update("distances", 0.3);
  if (!a.vdb.empty()) ttsdf::writeVdb(map, a.vdb);
  progress.update("occupancy", 0.5);
  if (!a.occupancy.empty()) {
    ttsdf::OccupancyOptions options;
    options.resolution = a.resolution;
    options.min_height = a.min_height;
    options.max_height = a.max_height;
    const ttsdf::OccupancyImage image = ttsdf::occupancyOf(map, options);
    ttsdf::writeOccupancy(image, a.occupancy);
    std::cout << image.width << " x " << image.height << " cells of " << image.resolution << " m\n";
  }
  progress.update("octomap", 0.7);
  if (!a.octomap.empty())
    std::cout << ttsdf::writeOctomap(map, a.octomap, a.resolution) << " occupied cells\n";
  if (!a.slice.empty()) ttsdf::writeSlice(map, a.height, a.slice);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("ttsdf_export", [&] { return run(argc, argv); });
}

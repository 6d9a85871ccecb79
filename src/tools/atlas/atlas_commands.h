#pragma once
// The commands of ttsdf_atlas. Each takes the arguments after the program's name, its own first, and returns
// an exit code.

#include <Eigen/Geometry>
#include <string>

#include "ttsdf_localization/atlas/atlas.h"

namespace ttsdf {

class Progress;

int runAtlasBuild(int argc, char** argv);
int runAtlasCell(int argc, char** argv);
int runAtlasFinish(int argc, char** argv);
int runAtlasInfo(int argc, char** argv);
int runAtlasCheck(int argc, char** argv);
int runAtlasAdd(int argc, char** argv);
int runAtlasRemove(int argc, char** argv);
int runAtlasRollback(int argc, char** argv);
int runAtlasUpdate(int argc, char** argv);
int runAtlasMerge(int argc, char** argv);
int runAtlasIndex(int argc, char** argv);
int runAtlasExport(int argc, char** argv);

/// Looks around in the maps that have changed and writes the index of places. Throws std::runtime_error
/// naming a map that cannot be read.
void updatePlaceIndex(const std::string& folder, Progress& progress);
/// "x,y,z" or "x,y,z,qx,qy,qz,qw"; empty: the identity. Throws UsageError naming the flag.
Eigen::Isometry3d poseFromText(const std::string& flag, const std::string& text);
/// Writes a map file into the folder and its entry into the atlas. An entry of this name is replaced, with
/// the next version, if the id differs. Returns a warning where what it was cannot be kept; empty otherwise.
std::string putMap(Atlas& atlas, const std::string& folder, AtlasMap entry,
                   const std::vector<std::uint8_t>& bytes);

}  // namespace ttsdf

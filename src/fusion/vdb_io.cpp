// Files of OpenVDB: TsdfVolume::fromVdbFile and saveVdb.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "ttsdf_localization/fusion/tsdf_volume_grids.h"
#include "vdb_import.h"

namespace ttsdf {

namespace {

// Metadata of the grid "tsdf" by which an own file is known.
constexpr char kVersionKey[] = "ttsdf_volume_version";
constexpr char kVoxelSizeKey[] = "ttsdf_voxel_size";
constexpr char kTruncationKey[] = "ttsdf_truncation";
constexpr char kFramesKey[] = "ttsdf_frames";
constexpr int kVersion = 1;

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw std::runtime_error("VDB file '" + path + "': " + what);
}

openvdb::GridPtrVec readGrids(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) fail(path, "no such file");
  try {
    openvdb::io::File file(path);
    file.open(false);  // no delayed loading: the file may change or go away
    const openvdb::GridPtrVecPtr grids = file.getGrids();
    file.close();
    if (grids) return *grids;
  } catch (const std::exception& error) {
    fail(path, std::string("cannot be read (") + error.what() + ")");
  }
  return {};
}

/// One grid at a time, so that the volume is not in memory twice.
void checkWritten(const std::string& temporary, const std::vector<openvdb::GridBase::ConstPtr>& grids,
                  const std::string& path) {
  try {
    openvdb::io::File file(temporary);
    file.open(false);
    for (const auto& grid : grids) {
      if (file.readGrid(grid->getName())->activeVoxelCount() != grid->activeVoxelCount())
        throw std::runtime_error("grid '" + grid->getName() + "' differs");
    }
  } catch (const std::exception& error) {
    std::error_code ignored;
    const auto space = std::filesystem::space(temporary, ignored);
    fail(path, std::string("cannot be written: read back it is not what was written (") + error.what() +
                   "); " + std::to_string(space.available / 1000000) + " MB are free on the disk");
  }
}

template <class GridType>
typename GridType::Ptr namedGrid(const openvdb::GridPtrVec& grids, const std::string& name,
                                 const std::string& path) {
  for (const auto& grid : grids) {
    if (grid && grid->getName() == name) {
      if (const auto typed = openvdb::gridPtrCast<GridType>(grid)) return typed;
    }
  }
  fail(path, "got no grid '" + name + "' of type " + GridType::gridType() +
                 ", though it says to be a saved volume");
}

openvdb::FloatGrid::Ptr firstFloatGrid(const openvdb::GridPtrVec& grids) {
  for (const auto& grid : grids) {
    if (grid && grid->isType<openvdb::FloatGrid>()) return openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
  }
  return nullptr;
}

FusionOptions ownOptions(const openvdb::FloatGrid& tsdf, FusionOptions options, const std::string& path) {
  const int version = tsdf.metaValue<openvdb::Int32>(kVersionKey);
  if (version != kVersion) {
    fail(path, "got volume version " + std::to_string(version) + ", wanted " + std::to_string(kVersion));
  }
  options.voxel_size = tsdf.metaValue<double>(kVoxelSizeKey);
  options.truncation = tsdf.metaValue<double>(kTruncationKey);
  return options;
}

void restore(const openvdb::GridPtrVec& grids, const std::string& path, TsdfVolume& volume) {
  TsdfVolume::Grids& own = volume.grids();
  const auto tsdf = namedGrid<openvdb::FloatGrid>(grids, "tsdf", path);
  const auto weight = namedGrid<openvdb::FloatGrid>(grids, "weight", path);
  const auto free = namedGrid<openvdb::MaskGrid>(grids, "free", path);
  const bool same_lattice = tsdf->transform() == own.tsdf->transform() &&
                            weight->transform() == own.tsdf->transform() &&
                            free->transform() == own.tsdf->transform();
  if (!same_lattice || tsdf->background() != own.tsdf->background() ||
      weight->activeVoxelCount() != tsdf->activeVoxelCount()) {
    fail(path, "its grids contradict each other or their metadata");
  }
  own.tsdf = tsdf, own.weight = weight, own.free = free;
  own.frame_count =
      static_cast<std::size_t>(std::max<openvdb::Int64>(0, tsdf->metaValue<openvdb::Int64>(kFramesKey)));
}

void checkForeign(const openvdb::FloatGrid& grid, const std::string& path) {
  const std::string name = "grid '" + grid.getName() + "': ";
  if (!grid.transform().isLinear()) fail(path, name + "got a transform that is not linear");
  if (grid.activeVoxelCount() == 0) fail(path, name + "got no active voxel");
  if (!std::isfinite(grid.background()) || grid.background() <= 0.0F) {
    fail(path,
         name + "got background " + std::to_string(grid.background()) + ", wanted the band's half width [m]");
  }
}

TsdfVolume import(const openvdb::FloatGrid& grid, FusionOptions options, const std::string& path) {
  checkForeign(grid, path);
  const VdbSurface surface = classifySurface(grid);
  if (surface == VdbSurface::kBroken) fail(path, "got NaN values, wanted signed distances");
  if (surface == VdbSurface::kNone)
    fail(path, "got no negative distance, wanted a signed one with a surface");
  if (surface == VdbSurface::kOpen) {
    if (grid.background() < options.voxel_size) {
      fail(path, "got a band of " + std::to_string(grid.background()) +
                     " m, wanted at least the voxel size " + std::to_string(options.voxel_size) + " m");
    }
    options.truncation = std::min(options.truncation, static_cast<double>(grid.background()));
  }
  TsdfVolume volume(options);
  surface == VdbSurface::kClosed ? importClosed(grid, options, volume.grids())
                                 : importOpen(grid, options, volume.grids());
  if (classifySurface(*volume.grids().tsdf) == VdbSurface::kNone) {
    fail(path, "got no surface that voxels of " + std::to_string(options.voxel_size) + " m can show");
  }
  return volume;
}

}  // namespace

TsdfVolume TsdfVolume::fromVdbFile(const std::string& path, FusionOptions options) {
  TsdfVolume checked(options);  // refuses bad options first, and readies OpenVDB
  const openvdb::GridPtrVec grids = readGrids(path);
  const openvdb::FloatGrid::Ptr grid = firstFloatGrid(grids);
  if (!grid) fail(path, "got " + std::to_string(grids.size()) + " grids and none of floats");
  try {
    if (!(*grid)[kVersionKey]) return import(*grid, options, path);
    TsdfVolume volume(ownOptions(*grid, options, path));
    restore(grids, path, volume);
    return volume;
  } catch (const std::invalid_argument& error) {
    fail(path, error.what());
  } catch (const openvdb::Exception& error) {
    fail(path, error.what());
  }
}

const FileKind kVdbFile{"an OpenVDB file", {' ', 'B', 'D', 'V', '\0', '\0', '\0', '\0'}};

void TsdfVolume::saveVdb(const std::string& path) const {
  // Shallow copies, so that the metadata does not stay on the volume's grids.
  const auto tsdf = grids_->tsdf->copy(), weight = grids_->weight->copy();
  tsdf->insertMeta(kVersionKey, openvdb::Int32Metadata(kVersion));
  tsdf->insertMeta(kVoxelSizeKey, openvdb::DoubleMetadata(options_.voxel_size));
  tsdf->insertMeta(kTruncationKey, openvdb::DoubleMetadata(options_.truncation));
  tsdf->insertMeta(kFramesKey, openvdb::Int64Metadata(static_cast<openvdb::Int64>(grids_->frame_count)));
  FileWriter writer(path, kVdbFile);
  try {
    openvdb::io::File file(writer.temporary());
    file.write({tsdf, weight, grids_->free});
    file.close();
  } catch (const std::exception& error) {
    fail(path, std::string("cannot be written (") + error.what() + ")");
  }
  // OpenVDB does not ask its stream whether the disk was full.
  writer.commit([&] { checkWritten(writer.temporary(), {tsdf, weight, grids_->free}, path); });
}

}  // namespace ttsdf

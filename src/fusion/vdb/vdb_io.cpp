// Files of OpenVDB: TsdfVolume::fromVdbFile and saveVdb.

#include <openvdb/tools/ChangeBackground.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <stdexcept>

#include "ttsdf_localization/build_steps/extent.h"
#include "ttsdf_localization/fusion/tsdf_volume_grids.h"
#include "ttsdf_localization/geometry/local_origin.h"
#include "ttsdf_localization/readers/child_process.h"
#include "ttsdf_localization/readers/file_bytes.h"
#include "vdb_import.h"
#include "vdb_reader.h"

namespace ttsdf {

namespace {

constexpr int kVersion = 1;

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw std::runtime_error("VDB file '" + path + "': " + what);
}

/// One grid at a time, so that the volume is not in memory twice; in a process of its own: of a file that was
/// cut off OpenVDB reads lengths of gigabytes.
void checkWritten(const std::string& temporary, const std::vector<openvdb::GridBase::ConstPtr>& grids,
                  const std::string& path) {
  try {
    runInChild("what was written", limitsForFile(temporary), [&] {
      openvdb::io::File file(temporary);
      file.open(false);
      for (const auto& grid : grids) {
        if (file.readGrid(grid->getName())->activeVoxelCount() != grid->activeVoxelCount())
          throw std::runtime_error("grid '" + grid->getName() + "' differs");
      }
      return std::string();
    });
  } catch (const std::exception& error) {
    std::error_code ignored;
    const auto space = std::filesystem::space(temporary, ignored);
    fail(path, std::string("cannot be written: read back it is not what was written (") +
                   std::string(shown(std::string_view(error.what()).substr(0, 200))) + "); " +
                   std::to_string(space.available / 1000000) + " MB are free on the disk");
  }
}

FusionOptions ownOptions(const VdbFileGrids& file, FusionOptions options, const std::string& path) {
  if (file.version != kVersion) {
    fail(path, "got volume version " + std::to_string(file.version) + ", wanted " + std::to_string(kVersion));
  }
  options.voxel_size = file.voxel_size;
  options.truncation = file.truncation;
  return options;
}

void restore(const VdbFileGrids& file, const std::string& path, TsdfVolume& volume) {
  TsdfVolume::Grids& own = volume.grids();
  const openvdb::math::Transform lattice = own.tsdf->transform();
  openvdb::math::Transform saved = lattice;
  saved.postTranslate(file.origin);
  const bool same_lattice = file.distance->transform() == saved && file.weight->transform() == saved &&
                            file.free->transform() == saved;
  if (!same_lattice || file.distance->background() != own.tsdf->background() ||
      file.weight->activeVoxelCount() != file.distance->activeVoxelCount()) {
    fail(path, "its grids contradict each other or their metadata");
  }
  for (openvdb::GridBase* grid :
       std::initializer_list<openvdb::GridBase*>{file.distance.get(), file.weight.get(), file.free.get()}) {
    grid->setTransform(lattice.copy());
  }
  own.tsdf = file.distance, own.weight = file.weight, own.free = file.free;
  own.frame_count = static_cast<std::size_t>(std::max<std::int64_t>(0, file.frames));
}

/// Other units: the lattice and the distances.
void rescale(openvdb::FloatGrid& grid, double scale) {
  const openvdb::math::Mat4d m = grid.transform().baseMap()->getAffineMap()->getMat4();
  openvdb::math::Mat4d scaled = m;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 3; ++column) scaled(row, column) *= scale;
  }
  grid.setTransform(openvdb::math::Transform::createLinearTransform(scaled));
  const auto factor = static_cast<float>(scale);
  for (auto value = grid.beginValueAll(); value; ++value) value.setValue(*value * factor);
  openvdb::tools::changeBackground(grid.tree(), grid.background() * factor);
}

/// Brings a grid that lies far away (UTM) near zero; returns where it was.
Eigen::Vector3d moveToOrigin(openvdb::FloatGrid& grid) {
  const openvdb::BBoxd world = grid.transform().indexToWorld(grid.evalActiveVoxelBoundingBox());
  if (grid.activeVoxelCount() == 0 || !world.min().isFinite() || !world.max().isFinite())
    return Eigen::Vector3d::Zero();
  const auto eigen = [](const openvdb::Vec3d& v) { return Eigen::Vector3d(v.x(), v.y(), v.z()); };
  const Eigen::Vector3d origin = localOrigin(eigen(world.min()), eigen(world.max()));
  if (!origin.isZero()) grid.transform().postTranslate(openvdb::Vec3d(-origin.x(), -origin.y(), -origin.z()));
  return origin;
}

/// The box of the active voxels, held against what can be built.
void checkSize(const openvdb::FloatGrid& grid, const FusionOptions& options, const std::string& path) {
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  const openvdb::BBoxd world = grid.transform().indexToWorld(box);
  const auto eigen = [](const openvdb::Vec3d& v) { return Eigen::Vector3d(v.x(), v.y(), v.z()); };
  std::vector<Eigen::Vector3d> leaves;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    if (!leaf->isEmpty()) leaves.push_back(eigen(grid.indexToWorld(leaf->origin())));
  }
  const openvdb::Vec3d voxel = grid.voxelSize();
  std::ostringstream hint;
  hint << "its voxels are " << voxel.x() << " m in its transform; --scale S makes metres of its units";
  try {
    checkExtent(eigen(world.min()), eigen(world.max()), options.voxel_size, leaves, "leaves of voxels",
                hint.str());
  } catch (const std::invalid_argument& error) {
    fail(path, "grid '" + grid.getName() + "': " + error.what());
  }
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
  checkSize(grid, options, path);
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

TsdfVolume TsdfVolume::fromVdbFile(const std::string& path, FusionOptions options, const VdbImport& source) {
  TsdfVolume checked(options);  // refuses bad options first, and readies OpenVDB
  if (!std::isfinite(source.scale) || source.scale <= 0.0) {
    throw std::invalid_argument("VDB file '" + path + "': got scale " + std::to_string(source.scale) +
                                ", wanted a positive number");
  }
  const VdbFileGrids file = readVdbFile(path, source.grid);
  if (source.note) *source.note = file.note;
  try {
    if (file.version == 0) {
      if (source.scale != 1.0) rescale(*file.distance, source.scale);
      const Eigen::Vector3d origin = moveToOrigin(*file.distance);
      TsdfVolume volume = import(*file.distance, options, path);
      volume.origin_ = origin;
      return volume;
    }
    if (source.scale != 1.0) fail(path, "is a saved volume, whose size is known: wanted no scale");
    TsdfVolume volume(ownOptions(file, options, path));
    restore(file, path, volume);
    volume.origin_ = Eigen::Vector3d(file.origin.x(), file.origin.y(), file.origin.z());
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
  const auto free = grids_->free->copy();
  tsdf->insertMeta(kVdbVersionKey, openvdb::Int32Metadata(kVersion));
  tsdf->insertMeta(kVdbVoxelSizeKey, openvdb::DoubleMetadata(options_.voxel_size));
  tsdf->insertMeta(kVdbTruncationKey, openvdb::DoubleMetadata(options_.truncation));
  tsdf->insertMeta(kVdbFramesKey, openvdb::Int64Metadata(static_cast<openvdb::Int64>(grids_->frame_count)));
  const openvdb::Vec3d origin(origin_.x(), origin_.y(), origin_.z());
  tsdf->insertMeta(kVdbOriginKey, openvdb::Vec3DMetadata(origin));
  if (!origin_.isZero()) {
    for (openvdb::GridBase* grid :
         std::initializer_list<openvdb::GridBase*>{tsdf.get(), weight.get(), free.get()}) {
      grid->setTransform(grid->transform().copy());
      grid->transform().postTranslate(origin);
    }
  }
  FileWriter writer(path, kVdbFile);
  try {
    openvdb::io::File file(writer.temporary());
    file.write({tsdf, weight, free});
    file.close();
  } catch (const std::exception& error) {
    fail(path, std::string("cannot be written (") + error.what() + ")");
  }
  // OpenVDB does not ask its stream whether the disk was full.
  writer.commit([&] { checkWritten(writer.temporary(), {tsdf, weight, free}, path); });
}

}  // namespace ttsdf

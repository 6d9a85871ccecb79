// The field as a grid of OpenVDB and as an octree.

#include <octomap/OcTree.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "ttsdf_localization/exports/exports.h"
#include "ttsdf_localization/geometry/local_origin.h"

namespace ttsdf {

void writeVdb(const TtSdfMap& map, const std::string& path) {
  openvdb::initialize();
  const double largest = std::max(map.clamp_positive, map.truncation);
  auto grid =
      openvdb::FloatGrid::create(static_cast<float>(largest > 0.0 ? largest : 3.0 * map.geometry.voxel_size));
  grid->setName("distance");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  const Eigen::Matrix3d R = map.geometry.T_map_grid.linear();
  const Eigen::Vector3d t = map.geometry.T_map_grid.translation();
  openvdb::math::Mat4d matrix = openvdb::math::Mat4d::identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      matrix(column, row) = map.geometry.voxel_size * R(row, column);  // row vectors
    matrix(3, row) = t[row];
  }
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  const DenseTensor values = full(map.train);
  auto accessor = grid->getAccessor();
  for (int k = 0; k < values.dims()[2]; ++k) {
    for (int j = 0; j < values.dims()[1]; ++j) {
      for (int i = 0; i < values.dims()[0]; ++i) {
        if (map.mask.atVoxel(i, j, k)) accessor.setValue({i, j, k}, values(i, j, k));
      }
    }
  }
  try {
    openvdb::io::File file(path);
    file.write({grid});
    file.close();
  } catch (const std::exception& error) {
    throw std::runtime_error("VDB file '" + path + "': cannot be written (" + error.what() + ")");
  }
}

std::size_t writeOctomap(const TtSdfMap& map, const std::string& path, double resolution) {
  if (!std::isfinite(resolution) || resolution < 0.0) {
    throw std::invalid_argument("octomap '" + path + "': got a resolution of " + std::to_string(resolution) +
                                " m");
  }
  const GridGeometry& g = map.geometry;
  octomap::OcTree tree(resolution > 0.0 ? resolution : g.voxel_size);
  constexpr double kKeys = 32767.0;  // an octree has 2^16 cells a side
  const double reach = kKeys * tree.getResolution();
  const Eigen::Vector3d low = g.samplePosition(Eigen::Vector3d::Zero());
  const Eigen::Vector3d high = g.samplePosition((g.dims - 1).cast<double>().matrix());
  if (std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff()) > reach) {
    throw std::invalid_argument("octomap '" + path + "': got a map " +
                                std::to_string(low.cwiseAbs().maxCoeff()) +
                                " m from the origin, wanted at most " + std::to_string(reach) +
                                " m, which is all that an octree of this resolution holds");
  }
  const DenseTensor values = full(map.train);
  const auto half = static_cast<float>(0.5 * std::max(tree.getResolution(), g.voxel_size));
  for (int pass = 0; pass < 2; ++pass) {  // free cells first: occupied ones win
    for (int k = 0; k < values.dims()[2]; ++k) {
      for (int j = 0; j < values.dims()[1]; ++j) {
        for (int i = 0; i < values.dims()[0]; ++i) {
          if (!map.mask.atVoxel(i, j, k)) continue;
          const float value = values(i, j, k);
          const bool occupied = std::abs(value) <= half;
          if (occupied != (pass == 1) || (!occupied && value < 0.0F)) continue;
          const Eigen::Vector3d p = g.samplePosition(Eigen::Vector3d(i, j, k));
          tree.setNodeValue(octomap::point3d(static_cast<float>(p.x()), static_cast<float>(p.y()),
                                             static_cast<float>(p.z())),
                            occupied ? tree.getClampingThresMaxLog() : tree.getClampingThresMinLog(), true);
        }
      }
    }
  }
  tree.updateInnerOccupancy();
  std::size_t occupied = 0;
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    occupied += tree.isNodeOccupied(*leaf) ? 1 : 0;
  }
  if (occupied == 0) throw std::runtime_error("octomap '" + path + "': the map shows no surface");
  if (!tree.writeBinary(path)) throw std::runtime_error("octomap '" + path + "': cannot be written");
  return occupied;
}

}  // namespace ttsdf

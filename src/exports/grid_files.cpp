// The field as a grid of OpenVDB.

#include <openvdb/openvdb.h>

#include <algorithm>
#include <stdexcept>

#include "export_ending.h"
#include "export_file.h"
#include "ttsdf_localization/exports/exports.h"
#include "ttsdf_localization/files/file_writer.h"

namespace ttsdf {

void writeVdb(const TtSdfMap& map, const std::string& path) {
  requireEnding("VDB file", path, {".vdb"});
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
  FileWriter writer(path);
  try {
    openvdb::io::File file(writer.temporary());
    file.write({grid});
    file.close();
  } catch (const std::exception& error) {
    throw std::runtime_error("VDB file '" + path + "': cannot be written (" + error.what() + ")");
  }
  writer.commit();
}

}  // namespace ttsdf

#include "ttsdf_localization/field/grid_geometry.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "ttsdf_localization/geometry/local_origin.h"

namespace ttsdf {

void check(const GridGeometry& geometry) {
  const Eigen::Matrix3d R = geometry.T_map_grid.linear();
  const bool rigid = geometry.T_map_grid.matrix().allFinite() &&
                     (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-6 &&
                     R.determinant() > 0.0;
  if ((geometry.dims >= 1).all() && std::isfinite(geometry.voxel_size) && geometry.voxel_size > 0.0 && rigid)
    return;
  std::ostringstream text;
  text << "grid geometry: got extents " << geometry.dims.transpose() << ", voxel size " << geometry.voxel_size
       << " m and a " << (rigid ? "rigid" : "non-rigid")
       << " T_map_grid, wanted extents >= 1, a positive voxel size and "
       << "a rigid motion";
  throw std::invalid_argument(text.str());
}

GridGeometry relativeToOrigin(GridGeometry geometry) {
  Eigen::Vector3d low = geometry.samplePosition(Eigen::Vector3d::Zero()), high = low;
  for (int corner = 1; corner < 8; ++corner) {
    const Eigen::Array3i bits(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    const Eigen::Vector3d p = geometry.samplePosition((bits * (geometry.dims - 1)).cast<double>().matrix());
    low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  const Eigen::Vector3d origin = localOrigin(low, high);
  geometry.T_map_grid.translation() -= origin;
  geometry.origin += origin;
  return geometry;
}

}  // namespace ttsdf

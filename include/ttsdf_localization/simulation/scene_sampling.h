#pragma once
// The exact distance of a scene on a whole grid: the truth that fused and compressed fields are held against.

#include "ttsdf_localization/field/grid_geometry.h"
#include "ttsdf_localization/simulation/analytic_scene.h"
#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

/// Grid whose samples cover a box, axes parallel to the map's. Throws std::invalid_argument for an empty box.
GridGeometry gridOver(const Eigen::AlignedBox3d& box, double voxel_size, double margin = 0.0);

/// Samples [begin, begin + size) of the grid's signed distances into `out` (first index fastest). Solids that
/// cannot be nearest are dropped block by block, so the cost per sample hardly grows with the number of
/// solids. Throws std::invalid_argument for a range outside the grid or an empty scene.
void sampleDistances(const AnalyticScene& scene, const GridGeometry& geometry, const Dims& begin,
                     const Dims& size, float* out);

/// The whole grid.
DenseTensor sampleDistances(const AnalyticScene& scene, const GridGeometry& geometry);

}  // namespace ttsdf

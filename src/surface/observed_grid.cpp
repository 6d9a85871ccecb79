#include "ttsdf_localization/surface/observed_grid.h"

#include <sstream>
#include <stdexcept>

namespace ttsdf {

void check(const ObservedGrid& grid) {
  const auto count = static_cast<std::size_t>(grid.dims.cast<std::int64_t>().prod());
  const bool sized = (grid.dims >= 2).all() && grid.tsdf.size() == count && grid.state.size() == count;
  if (sized && grid.voxel_size > 0.0 && grid.truncation > 0.0) return;
  std::ostringstream text;
  text << "observed grid: got extents " << grid.dims.transpose() << ", " << grid.tsdf.size() << " distances, "
       << grid.state.size() << " states, voxel size " << grid.voxel_size << " m, truncation "
       << grid.truncation << " m; wanted extents >= 2, one distance and one state per sample, positive sizes";
  throw std::invalid_argument(text.str());
}

}  // namespace ttsdf

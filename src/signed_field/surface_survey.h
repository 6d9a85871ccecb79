#pragma once
// A first look at a volume too large for dense arrays: which grid its surface asks for.

#include "../build_steps/parallel.h"
#include "field_grid.h"
#include "ttsdf_localization/fusion/tsdf_volume.h"

namespace ttsdf {

/// Equal boxes of at most `side` samples (a multiple of 8) that cover a grid; their edges lie at multiples of
/// 8.
class Tiling {
 public:
  Tiling(const Dims& dims, int side);

  int count() const { return counts_.prod(); }
  struct Box {
    Dims begin, size;
  };
  Box box(int number) const;

 private:
  Dims dims_, counts_, sides_;
};

/// The grid that sampleSurfaceDistance would choose: along the dominant planes if the options say so, around
/// the surface with their margin. The rotation is found from every 16th triangle. Throws std::runtime_error
/// if nothing was observed.
GridGeometry surveyGrid(const TsdfVolume& volume, const BuildOptions& options, const ProgressStep& step);

/// "got no zero crossing ..."
[[noreturn]] void throwNoSurface();

}  // namespace ttsdf

#pragma once
// Least free depth and greatest reach of rectangles of pixels, for deciding about whole blocks at once.

#include <vector>

#include "surface_pixels.h"

namespace ttsdf {

struct DepthRange {
  float min_free = 0.0F;   ///< every ray of the rectangle is free up to here [m along the optical axis]
  float max_reach = 0.0F;  ///< no ray of the rectangle says anything behind here [m]
};

class DepthPyramid {
 public:
  explicit DepthPyramid(const SurfacePixels& image);

  /// Range over the pixels [u0, u1] x [v0, v1], which must lie inside the image and not be empty.
  /// Conservative: pixels just outside may be counted in. Bounded cost.
  DepthRange range(int u0, int u1, int v0, int v1) const;
  /// Over the whole image [m].
  float maxReach() const { return levels_.back().ranges.front().max_reach; }

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<DepthRange> ranges;
  };
  std::vector<Level> levels_;  ///< level k holds squares of 2^(k + kFirstShift) pixels
};

}  // namespace ttsdf

#include "depth_pyramid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

namespace ttsdf {

namespace {

constexpr int kFirstShift = 2;  // finer than 4 x 4 pixels is never needed for a block of 8 voxels
constexpr int kMaxSpan = 4;     // squares a side that one query looks at, about

constexpr DepthRange kEmpty{std::numeric_limits<float>::infinity(), 0.0F};

void include(DepthRange& range, const DepthRange& other) {
  range.min_free = std::min(range.min_free, other.min_free);
  range.max_reach = std::max(range.max_reach, other.max_reach);
}

std::size_t at(int u, int v, int width) {
  return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
}

}  // namespace

DepthPyramid::DepthPyramid(const SurfacePixels& image) {
  const auto halved = [](int extent, int shift) { return ((extent - 1) >> shift) + 1; };
  Level first{halved(image.width, kFirstShift), halved(image.height, kFirstShift), {}};
  first.ranges.assign(static_cast<std::size_t>(first.width) * static_cast<std::size_t>(first.height), kEmpty);
  tbb::parallel_for(0, first.height, [&](int row) {
    const int end = std::min(image.height, (row + 1) << kFirstShift);
    for (int v = row << kFirstShift; v < end; ++v) {
      for (int u = 0; u < image.width; ++u) {
        const SurfacePixel& pixel = image.at(u, v);
        include(first.ranges[at(u >> kFirstShift, row, first.width)],
                {pixel.free_depth, std::max(pixel.free_depth, pixel.band_end)});
      }
    }
  });
  levels_.push_back(std::move(first));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& fine = levels_.back();
    Level coarse{halved(fine.width, 1), halved(fine.height, 1), {}};
    coarse.ranges.assign(static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height),
                         kEmpty);
    for (int v = 0; v < fine.height; ++v) {
      for (int u = 0; u < fine.width; ++u) {
        include(coarse.ranges[at(u >> 1, v >> 1, coarse.width)], fine.ranges[at(u, v, fine.width)]);
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

DepthRange DepthPyramid::range(int u0, int u1, int v0, int v1) const {
  std::size_t k = 0;
  const int span = std::max(u1 - u0, v1 - v0);
  while (k + 1 < levels_.size() && (span >> (k + kFirstShift)) > kMaxSpan) ++k;
  const Level& level = levels_[k];
  const int shift = static_cast<int>(k) + kFirstShift;
  DepthRange result = kEmpty;
  for (int v = v0 >> shift; v <= v1 >> shift; ++v) {
    for (int u = u0 >> shift; u <= u1 >> shift; ++u) include(result, level.ranges[at(u, v, level.width)]);
  }
  return result;
}

}  // namespace ttsdf

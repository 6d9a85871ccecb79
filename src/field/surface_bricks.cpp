#include "surface_bricks.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace ttsdf {

namespace {

constexpr float kReach = 2.0f;  // voxels from the surface of the last sample that makes a brick worth keeping
constexpr std::size_t kMostDecoded = 1u << 18;  // bricks looked at in full: about a second
// Half the diagonal of a brick, and some more: compressed distances change by a little more than one voxel
// per voxel.
const float kCentreReach = 1.15f * (0.5f * std::sqrt(3.0f) * kBrickCells + kReach);

}  // namespace

SurfaceBricks::SurfaceBricks(const StoredCores& cores, const GridGeometry& geometry, const SupportMask& mask)
    : cores_(cores), geometry_(geometry), mask_(mask), counts_(QuantizedBricks::countsFor(cores.sizes())) {}

Dims SurfaceBricks::toArray(int i, int j, int k) const {
  Dims index;
  index[cores_.axes()[0]] = i, index[cores_.axes()[1]] = j, index[cores_.axes()[2]] = k;
  return index;
}

/// Whether the map knows anything in a brick.
bool SurfaceBricks::supported(int a, int b, int c) const {
  if (mask_.empty()) return true;
  const Dims first = toArray(a, b, c) * kBrickCells / mask_.cellVoxels();
  const Dims last = ((toArray(a, b, c) + 1) * kBrickCells).min(geometry_.dims - 1) / mask_.cellVoxels();
  for (int z = first[2]; z <= last[2]; ++z) {
    for (int y = first[1]; y <= last[1]; ++y) {
      for (int x = first[0]; x <= last[0]; ++x) {
        if (mask_.at(x, y, z)) return true;
      }
    }
  }
  return false;
}

bool SurfaceBricks::nearSurface(int a, int b, int c, const float* samples) const {
  const float reach = kReach * static_cast<float>(geometry_.voxel_size);
  const auto& sizes = cores_.sizes();
  for (int n = 0; n < kBrickSamples; ++n) {
    if (!(std::abs(samples[n]) <= reach)) continue;
    const int i = std::min(a * kBrickCells + n % kBrickSide, sizes[0] - 1),
              j = std::min(b * kBrickCells + n / kBrickSide % kBrickSide, sizes[1] - 1),
              k = std::min(c * kBrickCells + n / kBrickSide / kBrickSide, sizes[2] - 1);
    const Dims at = toArray(i, j, k);
    if (mask_.atVoxel(at[0], at[1], at[2])) return true;
  }
  return false;
}

/// The last mode runs fastest: it needs the same columns.
template <class Visit>
void SurfaceBricks::forEachBrick(const KeepGoing& keep_going, const Visit& visit) const {
  const auto& n = counts_;
  for (int b = 0; b < n[1]; ++b) {
    for (int a = 0; a < n[0]; ++a) {
      goOn(keep_going);
      for (int c = 0; c < n[2]; ++c) visit(a, b, c);
    }
  }
}

QuantizedBricks SurfaceBricks::find(ColumnCache& columns, const KeepGoing& keep_going) const {
  const auto& sizes = cores_.sizes();
  const float reach = kCentreReach * static_cast<float>(geometry_.voxel_size);
  QuantizedBricks bricks(sizes);
  std::array<float, kBrickSamples> samples;
  std::size_t decoded = 0;
  forEachBrick(keep_going, [&](int a, int b, int c) {
    if (!supported(a, b, c)) return;
    const auto centre = [&](int at, int mode) {
      return std::min(at * kBrickCells + kBrickCells / 2, sizes[static_cast<std::size_t>(mode)] - 1);
    };
    if (std::abs(columns.sample(centre(a, 0), centre(b, 1), centre(c, 2))) > reach) return;
    if (decoded++ < kMostDecoded) {  // beyond, the centre tells as much as there is time for
      columns.box(a * kBrickCells, b * kBrickCells, c * kBrickCells, kBrickSide, samples.data());
      if (!nearSurface(a, b, c, samples.data())) return;
    }
    bricks.reserve(bricks.idOf(a, b, c));
  });
  return bricks;
}

void SurfaceBricks::fill(ColumnCache& columns, const KeepGoing& keep_going, QuantizedBricks& bricks) const {
  std::array<float, kBrickSamples> samples;
  forEachBrick(keep_going, [&](int a, int b, int c) {
    const QuantizedBricks::Id id = bricks.idOf(a, b, c);
    if (!bricks.has(id)) return;
    columns.box(a * kBrickCells, b * kBrickCells, c * kBrickCells, kBrickSide, samples.data());
    bricks.set(id, samples.data());
  });
}

}  // namespace ttsdf

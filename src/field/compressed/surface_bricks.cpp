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

QuantizedBricks SurfaceBricks::find(ColumnCache& columns, std::size_t most,
                                    const KeepGoing& keep_going) const {
  const auto& sizes = cores_.sizes();
  const float reach = kCentreReach * static_cast<float>(geometry_.voxel_size);
  QuantizedBricks bricks(sizes);
  std::array<float, kBrickSamples> samples;
  std::size_t decoded = 0, found = 0;
  const auto visit = [&](int a, int b, int c) {
    if (!supported(a, b, c)) return;
    const auto centre = [&](int at, int mode) {
      return std::min(at * kBrickCells + kBrickCells / 2, sizes[static_cast<std::size_t>(mode)] - 1);
    };
    if (std::abs(columns.sample(centre(a, 0), centre(b, 1), centre(c, 2))) > reach) return;
    const bool look = decoded < kMostDecoded;  // beyond, the centre tells as much as there is time for
    if (look || found < most) {
      ++decoded;
      columns.box(a * kBrickCells, b * kBrickCells, c * kBrickCells, kBrickSide, samples.data());
      if (look && !nearSurface(a, b, c, samples.data())) return;
    }
    if (found == most) bricks.dropAppended();
    if (found++ < most) {
      bricks.append(bricks.idOf(a, b, c), samples.data());
    } else {
      bricks.reserve(bricks.idOf(a, b, c));
    }
  };
  for (int b = 0; b < counts_[1]; ++b) {  // in the order of ids
    for (int a = 0; a < counts_[0]; ++a) {
      goOn(keep_going);
      for (int c = 0; c < counts_[2]; ++c) visit(a, b, c);
    }
  }
  if (found <= most) bricks.finish();
  return bricks;
}

}  // namespace ttsdf

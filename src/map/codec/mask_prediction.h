#pragma once
// Each cell of the support mask predicted from the cells before it: what the file stores are the surprises,
// sorted by how sure the prediction was.

#include <algorithm>
#include <array>
#include <cstdlib>

#include "ttsdf_localization/field/support_mask.h"

namespace ttsdf {

constexpr int kBuckets = 16;
/// Log-odds [0.1] of a cell being supported, given its neighbours that are coded before it: logistic
/// regression on masks of depth-camera maps (cells of 2 and 4 voxels agree).
struct Neighbour {
  int a, b, c, weight;
};
constexpr int kBias = -44;
inline constexpr std::array<Neighbour, 10> kNeighbours = {{{-1, 0, 0, 22},
                                                           {0, -1, 0, 20},
                                                           {0, 0, -1, 18},
                                                           {-1, -1, 0, 3},
                                                           {1, -1, 0, 10},
                                                           {-1, 0, -1, -1},
                                                           {1, 0, -1, 5},
                                                           {0, 1, -1, 11},
                                                           {1, 1, -1, 6},
                                                           {-1, -1, -1, -4}}};

inline int logOdds(const SupportMask& mask, int a, int b, int c) {
  const Dims& n = mask.cellDims();
  int sum = kBias;
  for (const Neighbour& step : kNeighbours) {
    const int x = a + step.a, y = b + step.b, z = c + step.c;
    if (x < 0 || y < 0 || z < 0 || x >= n[0] || y >= n[1]) continue;
    if (mask.at(x, y, z)) sum += step.weight;
  }
  return sum;
}

inline int bucketOf(int log_odds) { return std::min(std::abs(log_odds) / 3, kBuckets - 1); }

template <typename Visitor>
void forEachCell(const Dims& cells, const Visitor& visit) {
  for (int c = 0; c < cells[2]; ++c) {
    for (int b = 0; b < cells[1]; ++b) {
      for (int a = 0; a < cells[0]; ++a) visit(a, b, c);
    }
  }
}

}  // namespace ttsdf

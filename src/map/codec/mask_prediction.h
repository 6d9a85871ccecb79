#pragma once
// Each cell of the support mask predicted from the cells before it: what the file stores are the surprises,
// sorted by how sure the prediction was.

#include <algorithm>
#include <array>
#include <cstdint>
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

/// The same for the cells of a row one after the other, whose own bits become known on the way.
class RowOdds {
 public:
  RowOdds(const SupportMask& mask, int b, int c)
      : bits_(mask.bits().data()),
        length_(static_cast<std::size_t>(mask.cellDims()[0])),
        below_{row(mask, b - 1, c)},
        behind_{row(mask, b, c - 1)},
        behind_above_{row(mask, b + 1, c - 1)},
        behind_below_{row(mask, b - 1, c - 1)} {
    for (Window* window : {&below_, &behind_, &behind_above_, &behind_below_}) advance(*window);
    ++at_;
  }

  /// Of the next cell, given whether the cell before it is supported.
  int next(bool before) {
    for (Window* window : {&below_, &behind_, &behind_above_, &behind_below_}) advance(*window);
    ++at_;
    const Window &r = below_, &s = behind_, &t = behind_above_, &u = behind_below_;
    // Bit n is neighbour n.
    const unsigned known = unsigned{before} | r.here << 1 | s.here << 2 | r.before << 3 | r.after << 4 |
                           s.before << 5 | s.after << 6 | t.here << 7 | t.after << 8 | u.before << 9;
    return kSums[known];
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  struct Window {
    std::size_t first = kNone;  // place of the row's first bit
    unsigned before = 0, here = 0, after = 0;
  };
  static constexpr std::array<std::int16_t, 1u << kNeighbours.size()> kSums = [] {
    std::array<std::int16_t, 1u << kNeighbours.size()> sums{};
    for (std::size_t known = 0; known < sums.size(); ++known) {
      int sum = kBias;
      for (std::size_t n = 0; n < kNeighbours.size(); ++n) sum += known >> n & 1u ? kNeighbours[n].weight : 0;
      sums[known] = static_cast<std::int16_t>(sum);
    }
    return sums;
  }();

  static std::size_t row(const SupportMask& mask, int b, int c) {
    const Dims& n = mask.cellDims();
    if (b < 0 || c < 0 || b >= n[1]) return kNone;
    return static_cast<std::size_t>(n[0]) *
           (static_cast<std::size_t>(b) + static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(c));
  }

  void advance(Window& window) const {
    window.before = window.here;
    window.here = window.after;
    const std::size_t place = window.first + at_;
    window.after = window.first == kNone || at_ >= length_
                       ? 0u
                       : static_cast<unsigned>(bits_[place >> 6] >> (place & 63) & 1u);
  }

  const std::uint64_t* bits_;
  std::size_t length_;
  std::size_t at_ = 0;  // of the cell that comes into the windows next
  Window below_, behind_, behind_above_, behind_below_;
};

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

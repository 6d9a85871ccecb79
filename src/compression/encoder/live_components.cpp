#include "live_components.h"

#include <algorithm>

namespace ttsdf {

namespace {

std::vector<int> indicesOf(const std::vector<bool>& alive) {
  std::vector<int> live;
  for (std::size_t n = 0; n < alive.size(); ++n) {
    if (alive[n]) live.push_back(static_cast<int>(n));
  }
  if (live.empty()) live.push_back(0);
  return live;
}

std::vector<int> nonzeroColumns(const CoefficientBlock& basis) {
  std::vector<bool> alive(static_cast<std::size_t>(basis.extents[1]), false);
  for (std::size_t n = 0; n < basis.values.size(); ++n) {
    if (basis.values[n] != 0) alive[n / static_cast<std::size_t>(basis.extents[0])] = true;
  }
  return indicesOf(alive);
}

/// Slices of the middle core along its first (axis 0) or second index.
std::vector<int> nonzeroSlices(const CoefficientBlock& middle, std::size_t axis) {
  std::vector<bool> alive(static_cast<std::size_t>(middle.extents[axis]), false);
  const auto r1 = static_cast<std::size_t>(middle.extents[0]),
             r2 = static_cast<std::size_t>(middle.extents[1]);
  for (std::size_t n = 0; n < middle.values.size(); ++n) {
    if (middle.values[n] != 0) alive[axis == 0 ? n % r1 : n / r1 % r2] = true;
  }
  return indicesOf(alive);
}

void keepColumns(QuantizedBasis& basis, const std::vector<int>& columns) {
  CoefficientBlock kept(basis.values.extents[0], static_cast<int>(columns.size()), 1);
  std::vector<std::uint8_t> coarseness;
  const auto rows = static_cast<std::ptrdiff_t>(basis.values.extents[0]);
  auto out = kept.values.begin();
  for (const int c : columns) {
    out = std::copy_n(basis.values.values.begin() + rows * c, rows, out);
    coarseness.push_back(basis.coarseness[static_cast<std::size_t>(c)]);
  }
  basis.values = std::move(kept);
  basis.coarseness = std::move(coarseness);
}

CoefficientBlock keepSlices(const CoefficientBlock& middle, const std::vector<int>& first,
                            const std::vector<int>& last) {
  CoefficientBlock kept(static_cast<int>(first.size()), static_cast<int>(last.size()), middle.extents[2]);
  const auto r1 = static_cast<std::size_t>(middle.extents[0]),
             r2 = static_cast<std::size_t>(middle.extents[1]);
  std::size_t n = 0;
  for (std::size_t f = 0; f < static_cast<std::size_t>(middle.extents[2]); ++f) {
    for (const int b : last) {
      for (const int a : first) {
        kept.values[n++] =
            middle.values[static_cast<std::size_t>(a) + r1 * (static_cast<std::size_t>(b) + r2 * f)];
      }
    }
  }
  return kept;
}

}  // namespace

LiveColumns dropZeroColumns(QuantizedBasis& first, QuantizedBasis& last) {
  LiveColumns live{nonzeroColumns(first.values), nonzeroColumns(last.values)};
  keepColumns(first, live.first);
  keepColumns(last, live.last);
  return live;
}

void dropZeroComponents(QuantizedCores& cores) {
  for (;;) {
    const std::vector<int> first = nonzeroSlices(cores.middle, 0), last = nonzeroSlices(cores.middle, 1);
    if (first.size() == cores.first.coarseness.size() && last.size() == cores.last.coarseness.size()) break;
    keepColumns(cores.first, first);
    keepColumns(cores.last, last);
    cores.middle = keepSlices(cores.middle, first, last);
  }
  cores.header.rank1 = cores.middle.extents[0];
  cores.header.rank2 = cores.middle.extents[1];
}

}  // namespace ttsdf

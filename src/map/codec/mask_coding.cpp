#include "mask_coding.h"

#include <algorithm>
#include <array>

#include "bit_packer.h"
#include "byte_compression.h"

namespace ttsdf {

namespace {

constexpr int kBuckets = 16;
constexpr std::uint32_t kMaxCellVoxels = 1u << 20;
/// More cells than any grid that fits a map; 32 MB of mask.
constexpr std::uint64_t kMaxCells = std::uint64_t{1} << 28;

/// Log-odds [0.1] of a cell being supported, given its neighbours that are coded before it: logistic
/// regression on masks of depth-camera maps (cells of 2 and 4 voxels agree).
struct Neighbour {
  int a, b, c, weight;
};
constexpr int kBias = -44;
constexpr std::array<Neighbour, 10> kNeighbours = {{{-1, 0, 0, 22},
                                                    {0, -1, 0, 20},
                                                    {0, 0, -1, 18},
                                                    {-1, -1, 0, 3},
                                                    {1, -1, 0, 10},
                                                    {-1, 0, -1, -1},
                                                    {1, 0, -1, 5},
                                                    {0, 1, -1, 11},
                                                    {1, 1, -1, 6},
                                                    {-1, -1, -1, -4}}};

int logOdds(const SupportMask& mask, int a, int b, int c) {
  const Dims& n = mask.cellDims();
  int sum = kBias;
  for (const Neighbour& step : kNeighbours) {
    const int x = a + step.a, y = b + step.b, z = c + step.c;
    if (x < 0 || y < 0 || z < 0 || x >= n[0] || y >= n[1]) continue;
    if (mask.at(x, y, z)) sum += step.weight;
  }
  return sum;
}

int bucketOf(int log_odds) { return std::min(std::abs(log_odds) / 3, kBuckets - 1); }

template <typename Visitor>
void forEachCell(const Dims& cells, const Visitor& visit) {
  for (int c = 0; c < cells[2]; ++c) {
    for (int b = 0; b < cells[1]; ++b) {
      for (int a = 0; a < cells[0]; ++a) visit(a, b, c);
    }
  }
}

}  // namespace

void writeMask(const SupportMask& mask, ByteWriter& out) {
  std::array<std::vector<bool>, kBuckets> surprises;
  forEachCell(mask.cellDims(), [&](int a, int b, int c) {
    const int odds = logOdds(mask, a, b, c);
    surprises[static_cast<std::size_t>(bucketOf(odds))].push_back(mask.at(a, b, c) != (odds >= 0));
  });
  out.u32(static_cast<std::uint32_t>(mask.cellVoxels()));
  std::vector<std::uint8_t> packed;
  for (const std::vector<bool>& bucket : surprises) {
    out.u32(static_cast<std::uint32_t>(bucket.size()));
    BitPacker bits;
    for (const bool surprise : bucket) bits.push(surprise);
    packed.insert(packed.end(), bits.bytes().begin(), bits.bytes().end());
  }
  out.block(compressBytes(packed));
}

SupportMask readMask(ByteReader& in, const Dims& dims) {
  const std::uint32_t cell_voxels = in.u32();
  if (cell_voxels < 1 || cell_voxels > kMaxCellVoxels) {
    refuse(in.what() + ": cell size", std::to_string(cell_voxels), "1 to " + std::to_string(kMaxCellVoxels));
  }
  const Dims cell_dims = (dims - 1) / static_cast<int>(cell_voxels) + 1;
  const Eigen::Array3d extents = cell_dims.cast<double>();
  if (extents.prod() > static_cast<double>(kMaxCells)) {
    refuse(in.what() + ": cells", std::to_string(extents.prod()), "at most " + std::to_string(kMaxCells));
  }
  const auto cells = static_cast<std::uint64_t>(extents.prod());
  std::array<std::size_t, kBuckets> size{}, at{};
  std::size_t bytes = 0;
  std::uint64_t total = 0;
  for (std::size_t n = 0; n < kBuckets; ++n) {
    size[n] = in.u32();
    total += size[n];
    at[n] = 8 * bytes;
    bytes += (size[n] + 7) / 8;
    size[n] += at[n];  // end of the bucket
  }
  if (total != cells) refuse(in.what() + ": coded cells", std::to_string(total), std::to_string(cells));
  ByteReader coded = in.block(in.what());
  const std::size_t coded_size = coded.remaining();
  const std::vector<std::uint8_t> packed =
      decompressBytes(coded.take(coded_size), coded_size, bytes, in.what());

  SupportMask mask(dims, static_cast<int>(cell_voxels), false);
  forEachCell(mask.cellDims(), [&](int a, int b, int c) {
    const int odds = logOdds(mask, a, b, c);
    const auto bucket = static_cast<std::size_t>(bucketOf(odds));
    if (at[bucket] == size[bucket]) refuse(in.what(), "cells that do not fit their prediction", "a mask");
    if (bitAt(packed.data(), at[bucket]++) != (odds >= 0)) mask.set(a, b, c, true);
  });
  return mask;
}

}  // namespace ttsdf

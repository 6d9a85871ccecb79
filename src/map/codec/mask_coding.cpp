#include "mask_coding.h"

#include <algorithm>
#include <array>

#include "bits.h"
#include "byte_compression.h"
#include "mask_prediction.h"

namespace ttsdf {

namespace {

constexpr std::uint32_t kMaxCellVoxels = 1u << 20;
/// More cells than any grid that fits a map; decoding takes some ns each.
constexpr double kMaxCells = 1 << 28;
/// A cell takes a bit as it is coded and a bit of the mask.
constexpr double kCellsPerMegabyte = 4e6;
/// LZMA never makes less than a byte of so many cells that are as expected.
constexpr double kCellsPerByte = 1 << 16;

}  // namespace

SupportMask readMask(ByteReader& in, const Dims& dims, double max_megabytes) {
  const std::uint32_t cell_voxels = in.u32();
  if (cell_voxels < 1 || cell_voxels > kMaxCellVoxels) {
    refuse(in.what() + ": cell size", std::to_string(cell_voxels), "1 to " + std::to_string(kMaxCellVoxels));
  }
  const Dims cell_dims = (dims - 1) / static_cast<int>(cell_voxels) + 1;
  const Eigen::Array3d extents = cell_dims.cast<double>();
  const double most = std::min(
      {kMaxCells, kCellsPerMegabyte * max_megabytes, kCellsPerByte * static_cast<double>(in.remaining())});
  if (!(extents.prod() <= most)) {
    refuse(in.what() + ": cells", std::to_string(extents.prod()), "at most " + std::to_string(most));
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
  for (int c = 0; c < cell_dims[2]; ++c) {
    for (int b = 0; b < cell_dims[1]; ++b) {
      RowOdds row(mask, b, c);
      bool supported = false;
      for (int a = 0; a < cell_dims[0]; ++a) {
        const int odds = row.next(supported);
        const auto bucket = static_cast<std::size_t>(bucketOf(odds));
        if (at[bucket] == size[bucket]) refuse(in.what(), "cells that do not fit their prediction", "a mask");
        supported = bitAt(packed.data(), at[bucket]++) != (odds >= 0);
        if (supported) mask.set(a, b, c, true);
      }
    }
  }
  return mask;
}

}  // namespace ttsdf

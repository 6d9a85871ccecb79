#include "mask_writer.h"

#include <array>

#include "../../map/codec/mask_prediction.h"
#include "bit_packer.h"
#include "byte_compressor.h"

namespace ttsdf {

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

}  // namespace ttsdf

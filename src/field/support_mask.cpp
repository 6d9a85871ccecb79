#include "ttsdf_localization/field/support_mask.h"

#include <sstream>
#include <stdexcept>

namespace ttsdf {

SupportMask::SupportMask(const Dims& dims, int cell_voxels, bool supported) : cell_voxels_(cell_voxels) {
  if ((dims < 1).any() || cell_voxels < 1) {
    std::ostringstream text;
    text << "support mask: got extents " << dims.transpose() << " and cells of " << cell_voxels
         << " voxels, wanted all >= 1";
    throw std::invalid_argument(text.str());
  }
  cell_dims_ = (dims - 1) / cell_voxels + 1;
  const std::size_t cells = linear(0, 0, cell_dims_[2]);
  bits_.assign((cells + 63) / 64, supported ? ~std::uint64_t{0} : 0);
  // Bits behind the last cell stay zero, so that equal masks have equal words.
  if (supported && cells % 64 != 0) bits_.back() = (std::uint64_t{1} << (cells % 64)) - 1;
}

void SupportMask::set(int a, int b, int c, bool supported) {
  const std::size_t n = linear(a, b, c);
  const std::uint64_t flag = std::uint64_t{1} << (n & 63);
  if (supported) {
    bits_[n >> 6] |= flag;
  } else {
    bits_[n >> 6] &= ~flag;
  }
}

double SupportMask::supportedShare() const {
  if (bits_.empty()) return 1.0;
  const std::size_t cells = linear(0, 0, cell_dims_[2]);
  std::size_t supported = 0;
  for (std::size_t n = 0; n < cells; ++n) supported += bit(n) ? 1 : 0;
  return static_cast<double>(supported) / static_cast<double>(cells);
}

}  // namespace ttsdf

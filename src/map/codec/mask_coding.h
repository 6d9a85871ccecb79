#pragma once
// The support mask in a few kB: every cell is predicted from the cells before it, the surprises are sorted by
// how sure the prediction was, and the sorted bits are compressed.

#include "../format/byte_io.h"
#include "ttsdf_localization/field/support_mask.h"

namespace ttsdf {

/// The mask of a grid of `dims` voxels. Throws MapFormatError.
SupportMask readMask(ByteReader& in, const Dims& dims, double max_megabytes);

}  // namespace ttsdf

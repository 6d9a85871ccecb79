#pragma once
// The writer's side of mask_coding.h.

#include "byte_writer.h"
#include "ttsdf_localization/field/support_mask.h"

namespace ttsdf {

/// Cell size and the coded cells. The mask must not be empty.
void writeMask(const SupportMask& mask, ByteWriter& out);

}  // namespace ttsdf

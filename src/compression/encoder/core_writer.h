#pragma once
// The writer's side of encoding.h: the section 'CORE' of the map file.

#include "../../map/codec/quantized_cores.h"
#include "byte_writer.h"
#include "ttsdf_localization/compression/map_writer.h"

namespace ttsdf {

/// What the rest of the map says about the cores.
struct CoreBudget {
  double default_rms;       ///< [m], for options that name none
  std::size_t other_bytes;  ///< of the file without its cores
};

/// Throws std::invalid_argument for what serialize's documentation lists.
void writeCores(const TensorTrain& train, const EncodeOptions& options, const CoreBudget& budget,
                ByteWriter& out);

/// The section of quantised cores.
void writeQuantized(const QuantizedCores& cores, ByteWriter& out);

}  // namespace ttsdf

#pragma once
// Quantisation leaves some components with nothing but zeros: they need not be stored, and the map that is
// read has lower ranks.

#include "../../map/codec/quantized_cores.h"

namespace ttsdf {

/// Removes the columns of both bases that are zero; the middle core must not exist yet. Which ones stayed.
struct LiveColumns {
  std::vector<int> first, last;
};
LiveColumns dropZeroColumns(QuantizedBasis& first, QuantizedBasis& last);

/// Removes components whose slice of the middle core is zero, until none is left; at least one stays. Sets
/// the ranks.
void dropZeroComponents(QuantizedCores& cores);

}  // namespace ttsdf

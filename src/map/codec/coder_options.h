#pragma once
// How liblzma is used by the map file.

#include <lzma.h>

#include <stdexcept>

namespace ttsdf {

/// Part of the format: the reader must use the same. No literal context and no position bits, because the
/// streams are sorted by their statistics: neighbours are alike, the byte before says nothing more.
inline lzma_options_lzma coderOptions() {
  lzma_options_lzma options{};
  if (lzma_lzma_preset(&options, 9 | LZMA_PRESET_EXTREME))
    throw std::runtime_error("liblzma: preset 9 is missing");
  options.dict_size = 1u << 20;
  options.lc = 0;
  options.lp = 0;
  options.pb = 0;
  return options;
}

}  // namespace ttsdf

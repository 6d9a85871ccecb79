#include "byte_compressor.h"

#include <string>

#include "../../map/codec/coder_options.h"

namespace ttsdf {

std::vector<std::uint8_t> compressBytes(const std::vector<std::uint8_t>& raw) {
  lzma_options_lzma options = coderOptions();
  const lzma_filter filters[] = {{LZMA_FILTER_LZMA1, &options}, {LZMA_VLI_UNKNOWN, nullptr}};
  std::vector<std::uint8_t> coded(raw.size() + raw.size() / 8 + 64);
  const std::uint8_t nothing = 0;
  std::size_t size = 0;
  const lzma_ret result = lzma_raw_buffer_encode(filters, nullptr, raw.empty() ? &nothing : raw.data(),
                                                 raw.size(), coded.data(), &size, coded.size());
  if (result != LZMA_OK)
    throw std::runtime_error("liblzma: got code " + std::to_string(result) + ", wanted 0");
  coded.resize(size);
  return coded;
}

}  // namespace ttsdf

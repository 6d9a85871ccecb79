#include "byte_compression.h"

#include <algorithm>

#include "../format/byte_io.h"
#include "coder_options.h"

namespace ttsdf {

std::vector<std::uint8_t> decompressBytes(const std::uint8_t* data, std::size_t size, std::size_t raw_size,
                                          const std::string& what) {
  lzma_options_lzma options = coderOptions();
  // No match reaches back further than what came before: room for that is enough.
  const std::size_t most = std::max<std::size_t>(raw_size + 1, LZMA_DICT_SIZE_MIN);
  options.dict_size = static_cast<std::uint32_t>(std::min<std::size_t>(options.dict_size, most));
  const lzma_filter filters[] = {{LZMA_FILTER_LZMA1, &options}, {LZMA_VLI_UNKNOWN, nullptr}};
  std::vector<std::uint8_t> raw(raw_size + 1);  // one more: a stream that is too long shows
  std::size_t consumed = 0, produced = 0;
  const lzma_ret result =
      lzma_raw_buffer_decode(filters, nullptr, data, &consumed, size, raw.data(), &produced, raw.size());
  if (result != LZMA_OK || consumed != size || produced != raw_size) {
    refuse(what,
           "a damaged stream (liblzma code " + std::to_string(result) + ", " + std::to_string(produced) +
               " bytes)",
           std::to_string(raw_size) + " bytes");
  }
  raw.resize(raw_size);
  return raw;
}

}  // namespace ttsdf

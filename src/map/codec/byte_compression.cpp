#include "byte_compression.h"

#include <lzma.h>

#include <stdexcept>

#include "../format/byte_io.h"

namespace ttsdf {

namespace {

/// Part of the format: the reader must use the same. No literal context and no position bits, because the
/// streams are sorted by their statistics: neighbours are alike, the byte before says nothing more.
lzma_options_lzma coderOptions() {
  lzma_options_lzma options{};
  if (lzma_lzma_preset(&options, 9 | LZMA_PRESET_EXTREME))
    throw std::runtime_error("liblzma: preset 9 is missing");
  options.dict_size = 1u << 20;
  options.lc = 0;
  options.lp = 0;
  options.pb = 0;
  return options;
}

}  // namespace

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

std::vector<std::uint8_t> decompressBytes(const std::uint8_t* data, std::size_t size, std::size_t raw_size,
                                          const std::string& what) {
  lzma_options_lzma options = coderOptions();
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

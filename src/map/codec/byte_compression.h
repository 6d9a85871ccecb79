#pragma once
// Lossless compression of one block of the map file: liblzma's adaptive binary range coder without a
// container (section sizes and checksums are the file's business).

#include <cstdint>
#include <string>
#include <vector>

namespace ttsdf {

/// Exactly `raw_size` bytes; throws MapFormatError, naming `what`, for anything else.
std::vector<std::uint8_t> decompressBytes(const std::uint8_t* data, std::size_t size, std::size_t raw_size,
                                          const std::string& what);

}  // namespace ttsdf

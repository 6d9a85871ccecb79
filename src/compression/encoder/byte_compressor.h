#pragma once
// The writer's side of byte_compression.h.

#include <cstdint>
#include <vector>

namespace ttsdf {

/// Throws std::runtime_error if liblzma fails (memory).
std::vector<std::uint8_t> compressBytes(const std::vector<std::uint8_t>& raw);

}  // namespace ttsdf

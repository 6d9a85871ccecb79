#pragma once
// Bits in bytes, the first one lowest.

#include <cstddef>
#include <cstdint>

namespace ttsdf {

inline bool bitAt(const std::uint8_t* bytes, std::size_t n) { return (bytes[n / 8] >> (n % 8)) & 1u; }

}  // namespace ttsdf

#pragma once
// Text of a map ends up in ROS strings and JSON, whose readers fail on anything but UTF-8.

#include <cstddef>
#include <string>

namespace ttsdf {

/// Well-formed UTF-8 as RFC 3629 has it: no overlong forms, no surrogates, nothing above U+10FFFF.
inline bool isUtf8(const std::string& text) {
  const auto byte = [&](std::size_t n) { return static_cast<unsigned char>(text[n]); };
  for (std::size_t n = 0; n < text.size();) {
    const unsigned lead = byte(n);
    const std::size_t length = lead < 0x80   ? 1
                               : lead < 0xC2 ? 0
                               : lead < 0xE0 ? 2
                               : lead < 0xF0 ? 3
                               : lead < 0xF5 ? 4
                                             : 0;
    if (length == 0 || n + length > text.size()) return false;
    for (std::size_t k = 1; k < length; ++k) {
      if ((byte(n + k) & 0xC0u) != 0x80u) return false;
    }
    if (length > 2) {
      const unsigned second = byte(n + 1);
      const bool overlong = (lead == 0xE0 && second < 0xA0) || (lead == 0xF0 && second < 0x90);
      const bool surrogate = lead == 0xED && second >= 0xA0;
      const bool too_high = lead == 0xF4 && second >= 0x90;
      if (overlong || surrogate || too_high) return false;
    }
    n += length;
  }
  return true;
}

}  // namespace ttsdf

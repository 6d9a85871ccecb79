#pragma once
// Bits out of a range-coded stream (Martin 1979; carry-free as in lpaq, Mahoney 2007).

#include <cstdint>

#include "../format/byte_io.h"

namespace ttsdf {

class RangeDecoder {
 public:
  /// Reads to the end of `in`, and zeros behind it: `finish` tells.
  explicit RangeDecoder(ByteReader& in) : in_(in) {
    for (int n = 0; n < 4; ++n) value_ = value_ << 8 | next();
  }

  /// The next bit, a 1 with a probability of so many 4096ths.
  bool code(bool /*unknown*/, int probability) {
    const std::uint32_t middle = low_ + ((high_ - low_) >> 12) * static_cast<std::uint32_t>(probability);
    const bool bit = value_ <= middle;
    (bit ? high_ : low_) = bit ? middle : middle + 1;
    while (((low_ ^ high_) & 0xFF000000u) == 0) {
      low_ <<= 8;
      high_ = high_ << 8 | 255u;
      value_ = value_ << 8 | next();
    }
    return bit;
  }

  /// Throws MapFormatError if more was read than there is.
  void check() const {
    if (missing_ > 0) refuse(in_.what() + ": stream", "one that ends too early", "all of it");
  }
  /// Throws MapFormatError unless the stream ended with its last bit.
  void expectEnd() const {
    check();
    in_.expectEnd();
  }

 private:
  std::uint32_t next() {
    if (in_.remaining() > 0) return in_.u8();
    ++missing_;
    return 0;
  }

  ByteReader& in_;
  std::uint32_t low_ = 0, high_ = 0xFFFFFFFFu, value_ = 0;
  std::uint32_t missing_ = 0;
};

}  // namespace ttsdf

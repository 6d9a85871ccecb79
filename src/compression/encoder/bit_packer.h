#pragma once
// Bits in bytes, the first one lowest.

#include <cstdint>
#include <vector>

namespace ttsdf {

class BitPacker {
 public:
  void push(bool bit) {
    if (count_ % 8 == 0) bytes_.push_back(0);
    bytes_.back() = static_cast<std::uint8_t>(bytes_.back() | (static_cast<unsigned>(bit) << (count_ % 8)));
    ++count_;
  }
  std::size_t count() const { return count_; }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t count_ = 0;
};

}  // namespace ttsdf

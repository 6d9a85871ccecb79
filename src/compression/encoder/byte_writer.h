#pragma once
// Little-endian bytes of the map file.

#include <cstdint>
#include <string>
#include <vector>

namespace ttsdf {

class ByteWriter {
 public:
  void u8(std::uint8_t value) { bytes_.push_back(value); }
  void u16(std::uint16_t value) { integer(value, 2); }
  void u32(std::uint32_t value) { integer(value, 4); }
  void u64(std::uint64_t value) { integer(value, 8); }
  void f32(float value);
  void f64(double value);
  /// Length (u32) and bytes.
  void string(const std::string& text);
  void bytes(const std::vector<std::uint8_t>& data) { bytes_.insert(bytes_.end(), data.begin(), data.end()); }
  /// Length (u32) and bytes.
  void block(const std::vector<std::uint8_t>& data);

  std::size_t size() const { return bytes_.size(); }
  const std::vector<std::uint8_t>& data() const { return bytes_; }
  std::vector<std::uint8_t>& data() { return bytes_; }

 private:
  void integer(std::uint64_t value, int size) {
    for (int n = 0; n < size; ++n) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * n)));
  }
  std::vector<std::uint8_t> bytes_;
};

}  // namespace ttsdf

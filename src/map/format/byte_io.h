#pragma once
// Little-endian bytes of the map file, read without ever trusting a size.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace ttsdf {

/// Reads a range that it does not own. Every reader throws MapFormatError, naming `what`, when the bytes run
/// out.
class ByteReader {
 public:
  ByteReader(const std::uint8_t* data, std::size_t size, std::string what)
      : data_(data), size_(size), what_(std::move(what)) {}

  std::uint8_t u8() { return *take(1); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(integer(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(integer(4)); }
  std::uint64_t u64() { return integer(8); }
  float f32();
  double f64();
  std::string string();
  /// `size` bytes in place.
  const std::uint8_t* take(std::size_t size);
  /// A reader of the next block (u32 length + bytes).
  ByteReader block(const std::string& what);

  const std::string& what() const { return what_; }
  std::size_t remaining() const { return size_ - position_; }
  /// Throws MapFormatError if bytes are left over.
  void expectEnd() const;

 private:
  std::uint64_t integer(int size);

  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t position_ = 0;
  std::string what_;
};

/// Throws MapFormatError "<what>: got <got>, wanted <wanted>".
[[noreturn]] void refuse(const std::string& what, const std::string& got, const std::string& wanted);

}  // namespace ttsdf

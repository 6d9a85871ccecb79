#include "byte_io.h"

#include <cstring>

#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

static_assert(sizeof(float) == 4 && sizeof(double) == 8, "the map file stores IEEE 754 numbers");

void refuse(const std::string& what, const std::string& got, const std::string& wanted) {
  throw MapFormatError(what + ": got " + got + ", wanted " + wanted);
}

const std::uint8_t* ByteReader::take(std::size_t size) {
  if (size > remaining()) {
    refuse(what_, "only " + std::to_string(remaining()) + " more bytes", std::to_string(size));
  }
  const std::uint8_t* const begin = data_ + position_;
  position_ += size;
  return begin;
}

std::uint64_t ByteReader::integer(int size) {
  const std::uint8_t* const bytes = take(static_cast<std::size_t>(size));
  std::uint64_t value = 0;
  for (int n = 0; n < size; ++n) value |= static_cast<std::uint64_t>(bytes[n]) << (8 * n);
  return value;
}

float ByteReader::f32() {
  const std::uint32_t raw = u32();
  float value = 0.0f;
  std::memcpy(&value, &raw, sizeof(value));
  return value;
}

double ByteReader::f64() {
  const std::uint64_t raw = u64();
  double value = 0.0;
  std::memcpy(&value, &raw, sizeof(value));
  return value;
}

std::string ByteReader::string() {
  const std::size_t size = u32();
  const std::uint8_t* const bytes = take(size);
  return std::string(bytes, bytes + size);
}

ByteReader ByteReader::block(const std::string& what) {
  const std::size_t size = u32();
  return ByteReader(take(size), size, what);
}

void ByteReader::expectEnd() const {
  if (remaining() != 0) refuse(what_, std::to_string(remaining()) + " bytes left over", "0");
}

}  // namespace ttsdf

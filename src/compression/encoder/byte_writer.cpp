#include "byte_writer.h"

#include <cstring>

namespace ttsdf {

void ByteWriter::f32(float value) {
  std::uint32_t raw = 0;
  std::memcpy(&raw, &value, sizeof(raw));
  u32(raw);
}

void ByteWriter::f64(double value) {
  std::uint64_t raw = 0;
  std::memcpy(&raw, &value, sizeof(raw));
  u64(raw);
}

void ByteWriter::string(const std::string& text) {
  u32(static_cast<std::uint32_t>(text.size()));
  bytes_.insert(bytes_.end(), text.begin(), text.end());
}

void ByteWriter::block(const std::vector<std::uint8_t>& data) {
  u32(static_cast<std::uint32_t>(data.size()));
  bytes(data);
}

}  // namespace ttsdf

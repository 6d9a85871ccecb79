// Map files, past their checksums: the fuzzer changes the sections, the sums are put right before the reader
// sees them. All decoders run, and nothing is made of the map. Most inputs are read with limits of small
// maps: a few bytes may claim 65536 numbers and 4 million cells of the mask, which take the time of a
// thousand other inputs and show nothing that some hundred of them do not.

#include <cstdint>
#include <cstring>
#include <vector>

#include "../../src/map/format/map_container.h"
#include "ttsdf_localization/map/map_io.h"

namespace {

constexpr std::size_t kHeader = 32, kEntry = 24, kChecksumAt = 24;
constexpr std::uint32_t kOneInWithUsualLimits = 256;

/// The input's sum chooses, so that no corpus can gather around the slow ones.
ttsdf::MapLimits limitsFor(const std::uint8_t* data, std::size_t size) {
  ttsdf::MapLimits limits;
  if (ttsdf::checksum(data, size) % kOneInWithUsualLimits == 0) return limits;
  limits.max_megabytes = 0.1;  // 6250 numbers
  limits.max_voxels = 2e5;
  return limits;
}

std::uint64_t number(const std::vector<std::uint8_t>& bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t n = 0; n < size; ++n) value |= std::uint64_t{bytes[at + n]} << (8 * n);
  return value;
}

void put(std::vector<std::uint8_t>& bytes, std::size_t at, std::uint64_t value, std::size_t size) {
  for (std::size_t n = 0; n < size; ++n) bytes[at + n] = static_cast<std::uint8_t>(value >> (8 * n));
}

/// Magic, version, size and every checksum as the writer would have them.
void putRight(std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < kHeader) return;
  std::memcpy(bytes.data(), ttsdf::kMapFile.magic.data(), ttsdf::kMapFile.magic.size());
  put(bytes, 16, bytes.size(), 8);
  const std::uint64_t sections = number(bytes, 12, 4);
  const std::size_t table = kHeader + kEntry * static_cast<std::size_t>(sections % 65);
  if (table > bytes.size()) return;
  std::size_t payload = table;
  for (std::size_t entry = kHeader; entry < table; entry += kEntry) {
    std::uint64_t size = number(bytes, entry + 8, 8);
    const std::uint64_t left = bytes.size() - payload;
    if (size > left || entry + kEntry == table) size = left;
    put(bytes, entry + 8, size, 8);
    put(bytes, entry + 16, ttsdf::checksum(bytes.data() + payload, static_cast<std::size_t>(size)), 4);
    payload += static_cast<std::size_t>(size);
  }
  const std::uint32_t before = ttsdf::checksum(bytes.data(), kChecksumAt);
  put(bytes, kChecksumAt, ttsdf::checksum(bytes.data() + kChecksumAt + 4, table - kChecksumAt - 4, before),
      4);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> bytes(data, data + size);
  putRight(bytes);
  try {
    ttsdf::deserialize(bytes.data(), bytes.size(), limitsFor(data, size));
    ttsdf::fileInfo(bytes.data(), bytes.size());
  } catch (const ttsdf::MapFormatError&) {
  }
  return 0;
}

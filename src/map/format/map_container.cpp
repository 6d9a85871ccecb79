#include "map_container.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <iomanip>
#include <sstream>

#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

namespace {

constexpr std::uint32_t kMaxSections = 64;
constexpr std::array<std::uint32_t, 7> kKnown = {{kGeometrySection, kFieldSection, kCoreSection, kMaskSection,
                                                  kMetadataSection, kAgreementSection, kViewpointSection}};

std::string hex(std::uint32_t value) {
  std::ostringstream text;
  text << std::hex << std::setw(8) << std::setfill('0') << value;
  return text.str();
}

std::string sectionName(std::uint32_t id) {
  std::string text;
  for (int n = 0; n < 4; ++n) {
    const auto c = static_cast<unsigned char>(id >> (8 * n));
    if (c < 0x20 || c > 0x7E) return "0x" + hex(id);
    text += static_cast<char>(c);
  }
  return text;
}

struct Header {
  std::uint32_t version, sections, checksum;
  std::uint64_t file_bytes;
};

Header readHeader(ByteReader& in) {
  const std::uint8_t* const magic = in.take(kMagic.size());
  if (!std::equal(kMagic.begin(), kMagic.end(), magic)) {
    std::ostringstream got;
    for (std::size_t n = 0; n < kMagic.size(); ++n) {
      got << (n ? " " : "bytes ") << std::hex << std::setw(2) << std::setfill('0') << int{magic[n]};
    }
    refuse("map file: magic", got.str(), "54 54 53 44 46 0d 0a 1a (a .ttsdf map)");
  }
  Header header{};
  header.version = in.u32();
  if (header.version != kMapFormatVersion) {
    refuse("map file: format version", std::to_string(header.version), std::to_string(kMapFormatVersion));
  }
  header.sections = in.u32();
  header.file_bytes = in.u64();
  header.checksum = in.u32();
  const std::uint32_t reserved = in.u32();
  if (reserved != 0) refuse("map file: reserved field", std::to_string(reserved), "0");
  return header;
}

}  // namespace

/// Of header and table, as if the checksum field were not there.
std::uint32_t headerChecksum(const std::uint8_t* data, std::size_t size) {
  const std::uint32_t before = checksum(data, kChecksumAt);
  return checksum(data + kChecksumAt + 4, size - kChecksumAt - 4, before);
}

std::uint32_t checksum(const std::uint8_t* data, std::size_t size, std::uint32_t start) {
  return static_cast<std::uint32_t>(crc32_z(start, data, size));
}

Container::Container(const std::uint8_t* data, std::size_t size) {
  ByteReader in(data, size, "map file");
  const Header header = readHeader(in);
  if (header.file_bytes != size) {
    refuse("map file: size", std::to_string(size) + " bytes", std::to_string(header.file_bytes));
  }
  if (header.sections > kMaxSections) {
    refuse("map file: sections", std::to_string(header.sections), "at most " + std::to_string(kMaxSections));
  }
  const std::size_t table_bytes = kEntryBytes * header.sections;
  ByteReader table(in.take(table_bytes), table_bytes, "map file: table of sections");
  const std::uint32_t actual = headerChecksum(data, kHeaderBytes + table_bytes);
  if (actual != header.checksum)
    refuse("map file: checksum of the header", hex(actual), hex(header.checksum));
  for (std::uint32_t n = 0; n < header.sections; ++n) {
    Entry entry{};
    entry.id = table.u32();
    entry.flags = table.u32();
    const std::uint64_t bytes = table.u64();
    const std::uint32_t crc = table.u32();
    if (table.u32() != 0) refuse("map file: reserved field of a section", "a number", "0");
    const std::string what = "section " + sectionName(entry.id);
    if (bytes > in.remaining()) {
      refuse(what + ": bytes", std::to_string(bytes), "at most " + std::to_string(in.remaining()));
    }
    entry.size = static_cast<std::size_t>(bytes);
    entry.payload = in.take(entry.size);
    const std::uint32_t got = checksum(entry.payload, entry.size);
    if (got != crc) refuse(what + ": checksum", hex(got), hex(crc));
    if (has(entry.id)) refuse(what, "it twice", "it once");
    const bool known = std::find(kKnown.begin(), kKnown.end(), entry.id) != kKnown.end();
    if (!known && (entry.flags & kRequiredFlag) != 0) {
      refuse(what, "a section that this version does not know but must", "sections of format version 1");
    }
    entries_.push_back(entry);
  }
  in.expectEnd();
}

bool Container::has(std::uint32_t id) const {
  return std::any_of(entries_.begin(), entries_.end(), [id](const Entry& entry) { return entry.id == id; });
}

ByteReader Container::section(std::uint32_t id) const {
  for (const Entry& entry : entries_) {
    if (entry.id == id) return ByteReader(entry.payload, entry.size, "section " + sectionName(id));
  }
  refuse("section " + sectionName(id), "none", "one");
}

}  // namespace ttsdf

#pragma once
// The frame of the map file: header, table of sections, payloads, checksums (doc/map_format.md).

#include <array>
#include <cstdint>
#include <vector>

#include "byte_io.h"

namespace ttsdf {

constexpr std::uint32_t kMapFormatVersion = 1;

/// Line ends of both kinds and the end-of-file of DOS: a transfer in text mode damages them visibly (as in
/// PNG).
constexpr std::array<std::uint8_t, 8> kMagic = {{'T', 'T', 'S', 'D', 'F', '\r', '\n', 0x1A}};
constexpr std::size_t kHeaderBytes = 32;
constexpr std::size_t kEntryBytes = 24;
constexpr std::size_t kChecksumAt = 24;

/// Four characters as one number, first character in the lowest byte: it reads as text in a hex dump.
constexpr std::uint32_t sectionId(const char (&text)[5]) {
  return static_cast<std::uint32_t>(static_cast<unsigned char>(text[0])) |
         static_cast<std::uint32_t>(static_cast<unsigned char>(text[1])) << 8 |
         static_cast<std::uint32_t>(static_cast<unsigned char>(text[2])) << 16 |
         static_cast<std::uint32_t>(static_cast<unsigned char>(text[3])) << 24;
}

constexpr std::uint32_t kGeometrySection = sectionId("GEOM");
constexpr std::uint32_t kFieldSection = sectionId("FIEL");
constexpr std::uint32_t kCoreSection = sectionId("CORE");
constexpr std::uint32_t kMaskSection = sectionId("MASK");
constexpr std::uint32_t kMetadataSection = sectionId("META");
constexpr std::uint32_t kAgreementSection = sectionId("AGRE");
constexpr std::uint32_t kViewpointSection = sectionId("VIEW");

/// A reader that does not know a section with this flag must refuse the file; without it, it skips the
/// section.
constexpr std::uint32_t kRequiredFlag = 1;

/// Sections in place; the bytes must outlive it.
class Container {
 public:
  /// Checks magic, version, sizes and every checksum. Throws MapFormatError.
  Container(const std::uint8_t* data, std::size_t size);

  bool has(std::uint32_t id) const;
  /// Throws MapFormatError if the section is missing.
  ByteReader section(std::uint32_t id) const;

 private:
  struct Entry {
    std::uint32_t id, flags;
    const std::uint8_t* payload;
    std::size_t size;
  };
  std::vector<Entry> entries_;
};

/// zlib's CRC-32, any size.
std::uint32_t checksum(const std::uint8_t* data, std::size_t size, std::uint32_t start = 0);
/// Of header and table, as if the checksum field were not there.
std::uint32_t headerChecksum(const std::uint8_t* data, std::size_t size);

}  // namespace ttsdf

#pragma once
// Takes a map file apart and puts it together again with valid checksums, written from doc/map_format.md and
// not from the implementation.

#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace ttsdf::test {

using Bytes = std::vector<std::uint8_t>;

template <typename T>
T getNumber(const Bytes& bytes, std::size_t at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

template <typename T>
void setNumber(Bytes& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof(T));
}

struct RawSection {
  std::string id;
  std::uint32_t flags = 0;
  Bytes payload;
};

struct RawFile {
  Bytes magic;
  std::uint32_t version = 0;
  std::vector<RawSection> sections;

  RawSection& section(const std::string& id) {
    for (RawSection& s : sections) {
      if (s.id == id) return s;
    }
    sections.push_back({id, 0, {}});
    return sections.back();
  }
};

constexpr std::size_t kHeaderBytes = 32, kEntryBytes = 24;

inline RawFile takeApart(const Bytes& bytes) {
  RawFile file;
  file.magic.assign(bytes.begin(), bytes.begin() + 8);
  file.version = getNumber<std::uint32_t>(bytes, 8);
  const auto count = getNumber<std::uint32_t>(bytes, 12);
  std::size_t at = kHeaderBytes + kEntryBytes * count;
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t entry = kHeaderBytes + kEntryBytes * n;
    RawSection section;
    section.id.assign(bytes.begin() + static_cast<std::ptrdiff_t>(entry),
                      bytes.begin() + static_cast<std::ptrdiff_t>(entry + 4));
    section.flags = getNumber<std::uint32_t>(bytes, entry + 4);
    const auto size = static_cast<std::size_t>(getNumber<std::uint64_t>(bytes, entry + 8));
    section.payload.assign(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                           bytes.begin() + static_cast<std::ptrdiff_t>(at + size));
    at += size;
    file.sections.push_back(section);
  }
  return file;
}

inline std::uint32_t crcOf(const Bytes& bytes) {
  return static_cast<std::uint32_t>(crc32(0, bytes.data(), static_cast<uInt>(bytes.size())));
}

/// The checksum of header and table, written into its place.
inline void sealHeader(Bytes& bytes) {
  const auto count = getNumber<std::uint32_t>(bytes, 12);
  Bytes covered(bytes.begin(), bytes.begin() + 24);
  covered.insert(covered.end(), bytes.begin() + 28,
                 bytes.begin() + static_cast<std::ptrdiff_t>(kHeaderBytes + kEntryBytes * count));
  setNumber(bytes, 24, crcOf(covered));
}

inline Bytes putTogether(const RawFile& file) {
  Bytes bytes = file.magic;
  bytes.resize(kHeaderBytes + kEntryBytes * file.sections.size(), 0);
  setNumber(bytes, 8, file.version);
  setNumber(bytes, 12, static_cast<std::uint32_t>(file.sections.size()));
  for (std::size_t n = 0; n < file.sections.size(); ++n) {
    const RawSection& section = file.sections[n];
    const std::size_t entry = kHeaderBytes + kEntryBytes * n;
    std::memcpy(bytes.data() + entry, section.id.data(), 4);
    setNumber(bytes, entry + 4, section.flags);
    setNumber(bytes, entry + 8, static_cast<std::uint64_t>(section.payload.size()));
    setNumber(bytes, entry + 16, crcOf(section.payload));
  }
  for (const RawSection& section : file.sections) {
    bytes.insert(bytes.end(), section.payload.begin(), section.payload.end());
  }
  setNumber(bytes, 16, static_cast<std::uint64_t>(bytes.size()));
  sealHeader(bytes);
  return bytes;
}

}  // namespace ttsdf::test

#include "ttsdf_localization/map/map_io.h"

#include <iomanip>
#include <sstream>

#include "codec/mask_coding.h"
#include "format/encoding.h"
#include "format/map_container.h"
#include "format/map_sections.h"

namespace ttsdf {

namespace {

template <typename Writer>
Section makeSection(std::uint32_t id, std::uint32_t flags, const Writer& write) {
  ByteWriter out;
  write(out);
  return {id, flags, std::move(out.data())};
}

}  // namespace

const char* name(Encoding encoding) {
  switch (encoding) {
    case Encoding::kFloat16:
      return "float16";
    case Encoding::kQuantized:
      return "quantized";
    case Encoding::kFloat32:
      break;
  }
  return "float32";
}

Encoding encodingFromName(const std::string& text) {
  for (const Encoding encoding : {Encoding::kFloat32, Encoding::kFloat16, Encoding::kQuantized}) {
    if (text == name(encoding)) return encoding;
  }
  throw std::invalid_argument("encoding: got '" + text + "', wanted float32, float16 or quantized");
}

std::vector<std::uint8_t> serialize(const TtSdfMap& map, const EncodeOptions& options) {
  check(map);
  std::vector<Section> sections;
  sections.push_back(makeSection(kGeometrySection, kRequiredFlag,
                                 [&](ByteWriter& out) { writeGeometry(map.geometry, out); }));
  sections.push_back(
      makeSection(kFieldSection, kRequiredFlag, [&](ByteWriter& out) { writeField(map, out); }));
  if (!map.mask.empty()) {
    sections.push_back(
        makeSection(kMaskSection, kRequiredFlag, [&](ByteWriter& out) { writeMask(map.mask, out); }));
  }
  if (!map.metadata.empty()) {
    sections.push_back(
        makeSection(kMetadataSection, 0, [&](ByteWriter& out) { writeMetadata(map.metadata, out); }));
  }
  if (map.agreement.known()) {
    sections.push_back(
        makeSection(kAgreementSection, 0, [&](ByteWriter& out) { writeAgreement(map.agreement, out); }));
  }
  sections.push_back({kCoreSection, kRequiredFlag, {}});
  const CoreBudget budget{0.1 * map.geometry.voxel_size, writeContainer(sections).size()};
  sections.back() = makeSection(kCoreSection, kRequiredFlag,
                                [&](ByteWriter& out) { writeCores(map.train, options, budget, out); });
  return writeContainer(sections);
}

std::size_t encodedSize(const TtSdfMap& map, const EncodeOptions& options) {
  return serialize(map, options).size();
}

TtSdfMap deserialize(const std::uint8_t* data, std::size_t size) {
  const Container container(data, size);
  TtSdfMap map;
  ByteReader geometry = container.section(kGeometrySection);
  map.geometry = readGeometry(geometry);
  ByteReader field = container.section(kFieldSection);
  readField(field, map);
  try {
    check(map.geometry);
    if (container.has(kMaskSection)) {
      ByteReader mask = container.section(kMaskSection);
      map.mask = readMask(mask, map.geometry.dims);
      mask.expectEnd();
    }
    if (container.has(kMetadataSection)) {
      ByteReader metadata = container.section(kMetadataSection);
      map.metadata = readMetadata(metadata);
    }
    if (container.has(kAgreementSection)) {
      ByteReader agreement = container.section(kAgreementSection);
      map.agreement = readAgreement(agreement);
    }
    ByteReader cores = container.section(kCoreSection);
    map.train = readCores(cores, map.geometry.dims);
    check(map);
  } catch (const std::invalid_argument& error) {
    throw MapFormatError(std::string("map file: ") + error.what());
  }
  return map;
}

MapFileInfo fileInfo(const std::uint8_t* data, std::size_t size) {
  ByteReader cores = Container(data, size).section(kCoreSection);
  MapFileInfo info;
  info.encoding = readEncoding(cores);
  info.file_bytes = size;
  std::ostringstream id;
  id << std::hex << std::setw(8) << std::setfill('0') << checksum(data, size);
  info.map_id = id.str();
  return info;
}

}  // namespace ttsdf

#include "ttsdf_localization/compression/map_writer.h"

#include "../map/format/map_container.h"
#include "encoder/core_writer.h"
#include "encoder/map_bytes.h"
#include "encoder/mask_writer.h"
#include "encoder/section_writer.h"

namespace ttsdf {

namespace {

template <typename Writer>
Section makeSection(std::uint32_t id, std::uint32_t flags, const Writer& write) {
  ByteWriter out;
  write(out);
  return {id, flags, std::move(out.data())};
}

/// All sections, the last one, of the cores, still empty.
std::vector<Section> sectionsAround(const TtSdfMap& map) {
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
  if (map.agreement.known() && !map.agreement.viewpoints.empty()) {
    sections.push_back(
        makeSection(kViewpointSection, 0, [&](ByteWriter& out) { writeViewpoints(map.agreement, out); }));
  }
  sections.push_back({kCoreSection, kRequiredFlag, {}});
  return sections;
}

std::vector<std::uint8_t> encoded(const TtSdfMap& map, const EncodeOptions& options) {
  check(map);
  std::vector<Section> sections = sectionsAround(map);
  const CoreBudget budget{0.1 * map.geometry.voxel_size, writeContainer(sections).size()};
  sections.back() = makeSection(kCoreSection, kRequiredFlag,
                                [&](ByteWriter& out) { writeCores(map.train, options, budget, out); });
  return writeContainer(sections);
}

}  // namespace

std::vector<std::uint8_t> serializeQuantized(const TtSdfMap& map, const QuantizedCores& cores) {
  std::vector<Section> sections = sectionsAround(map);
  sections.back() =
      makeSection(kCoreSection, kRequiredFlag, [&](ByteWriter& out) { writeQuantized(cores, out); });
  return writeContainer(sections);
}

std::vector<std::uint8_t> serialize(const TtSdfMap& map, const EncodeOptions& options) {
  std::vector<std::uint8_t> bytes = encoded(map, options);
  try {
    deserialize(bytes.data(), bytes.size());  // nothing is written that the reader would refuse
  } catch (const MapFormatError& error) {
    throw std::invalid_argument(std::string("map: got values that the encoding ") + name(options.encoding) +
                                " cannot hold (" + error.what() +
                                "), wanted distances in metres, or float32");
  }
  return bytes;
}

std::size_t encodedSize(const TtSdfMap& map, const EncodeOptions& options) {
  return encoded(map, options).size();
}

void saveMap(const TtSdfMap& map, const std::string& path, const EncodeOptions& options) {
  writeFileAtomically(path, serialize(map, options), kMapFile);
}

}  // namespace ttsdf

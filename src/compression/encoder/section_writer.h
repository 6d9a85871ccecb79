#pragma once
// The writer's side of map_container.h and map_sections.h.

#include <map>
#include <string>
#include <vector>

#include "byte_writer.h"
#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

struct Section {
  std::uint32_t id = 0;
  std::uint32_t flags = 0;
  std::vector<std::uint8_t> payload;
};

std::vector<std::uint8_t> writeContainer(const std::vector<Section>& sections);

void writeGeometry(const GridGeometry& geometry, ByteWriter& out);
/// Field kind, distances and frame.
void writeField(const TtSdfMap& map, ByteWriter& out);
/// Throws std::invalid_argument if a key or a value is no UTF-8.
void writeMetadata(const std::map<std::string, std::string>& metadata, ByteWriter& out);
void writeAgreement(const FrameAgreement& agreement, ByteWriter& out);
/// Throws std::invalid_argument for more viewpoints than the section can count.
void writeViewpoints(const FrameAgreement& agreement, ByteWriter& out);

}  // namespace ttsdf

#pragma once
// What each section of the map file holds, apart from the cores (encoding.h) and the mask (mask_coding.h).

#include "byte_io.h"
#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

void writeGeometry(const GridGeometry& geometry, ByteWriter& out);
GridGeometry readGeometry(ByteReader& in);

/// Field kind, distances and frame.
void writeField(const TtSdfMap& map, ByteWriter& out);
void readField(ByteReader& in, TtSdfMap& map);

/// Throws std::invalid_argument if a key or a value is no UTF-8.
void writeMetadata(const std::map<std::string, std::string>& metadata, ByteWriter& out);
std::map<std::string, std::string> readMetadata(ByteReader& in);

void writeAgreement(const FrameAgreement& agreement, ByteWriter& out);
FrameAgreement readAgreement(ByteReader& in);

}  // namespace ttsdf

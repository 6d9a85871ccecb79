#pragma once
// What each section of the map file holds, apart from the cores (encoding.h) and the mask (mask_coding.h).

#include "byte_io.h"
#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

GridGeometry readGeometry(ByteReader& in, double max_voxels);

/// Field kind, distances and frame.
void readField(ByteReader& in, TtSdfMap& map);

constexpr std::uint32_t kMaxMetadataBytes = 16u << 20;
std::map<std::string, std::string> readMetadata(ByteReader& in);

FrameAgreement readAgreement(ByteReader& in);

/// Of a viewpoint: direction in 127ths, ratio as 2^((code - 128) / 16).
constexpr double kViewSteps = 127.0, kRatioMiddle = 128.0, kRatioSteps = 16.0;
constexpr std::uint32_t kMaxViewpoints = 65535;
/// Into `agreement`.
void readViewpoints(ByteReader& in, FrameAgreement& agreement);

}  // namespace ttsdf

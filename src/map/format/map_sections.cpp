#include "map_sections.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "../codec/byte_compression.h"
#include "utf8.h"

namespace ttsdf {

namespace {

constexpr std::uint32_t kMaxExtent = 1u << 20;
// What is made of a map when it is loaded takes time with its voxels, however few bytes they take in the
// file.
constexpr double kMaxVoxels = 17179869184.0;                   // 2^34
constexpr double kMinVoxelSize = 1e-5, kMaxVoxelSize = 100.0;  // [m]

std::string readText(ByteReader& in) {
  std::string text = in.string();
  if (!isUtf8(text)) refuse(in.what(), "text with invalid bytes", "UTF-8");
  return text;
}

}  // namespace

GridGeometry readGeometry(ByteReader& in, double max_voxels) {
  GridGeometry geometry;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t extent = in.u32();
    if (extent < 1 || extent > kMaxExtent) {
      refuse(in.what() + ": extent", std::to_string(extent), "1 to " + std::to_string(kMaxExtent));
    }
    geometry.dims[axis] = static_cast<int>(extent);
  }
  const double voxels = geometry.dims.cast<double>().prod();
  const double most = std::min(max_voxels, kMaxVoxels);
  if (!(voxels <= most)) {
    std::ostringstream got, wanted;
    got << voxels, wanted << "at most " << most << " (max_map_voxels)";
    refuse(in.what() + ": number of voxels", got.str(), wanted.str());
  }
  geometry.voxel_size = in.f64();
  if (!(geometry.voxel_size >= kMinVoxelSize && geometry.voxel_size <= kMaxVoxelSize)) {
    refuse(in.what() + ": voxel size", std::to_string(geometry.voxel_size),
           std::to_string(kMinVoxelSize) + " to " + std::to_string(kMaxVoxelSize) + " m");
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) geometry.T_map_grid.matrix()(row, column) = in.f64();
  }
  in.expectEnd();
  return geometry;
}

void readField(ByteReader& in, TtSdfMap& map) {
  const std::uint8_t kind = in.u8();
  if (kind > static_cast<std::uint8_t>(FieldKind::kTsdf)) {
    refuse(in.what() + ": field kind", std::to_string(kind), "0 (sdf) or 1 (tsdf)");
  }
  map.kind = static_cast<FieldKind>(kind);
  map.truncation = in.f64();
  map.clamp_negative = in.f64();
  map.clamp_positive = in.f64();
  map.frame_id = readText(in);
  in.expectEnd();
}

std::map<std::string, std::string> readMetadata(ByteReader& in) {
  const std::uint32_t size = in.u32();
  if (size > kMaxMetadataBytes) {
    refuse(in.what() + ": bytes of text", std::to_string(size),
           "at most " + std::to_string(kMaxMetadataBytes));
  }
  ByteReader coded = in.block(in.what());
  in.expectEnd();
  const std::size_t coded_size = coded.remaining();
  const auto raw = decompressBytes(coded.take(coded_size), coded_size, size, in.what());
  ByteReader text(raw.data(), raw.size(), in.what());
  std::map<std::string, std::string> metadata;
  const std::uint32_t count = text.u32();
  for (std::uint32_t n = 0; n < count; ++n) {
    std::string key = readText(text);
    metadata[std::move(key)] = readText(text);
  }
  text.expectEnd();
  return metadata;
}

FrameAgreement readAgreement(ByteReader& in) {
  constexpr std::uint32_t kMostFrames = 1u << 30;
  FrameAgreement a;
  for (int* count : {&a.compared, &a.contradicting, &a.without_overlap}) {
    const std::uint32_t frames = in.u32();
    if (frames > kMostFrames) {
      refuse(in.what() + ": number of frames", std::to_string(frames),
             "at most " + std::to_string(kMostFrames));
    }
    *count = static_cast<int>(frames);
  }
  for (double* size : {&a.position_median, &a.position_90, &a.rotation_median, &a.rotation_90, &a.widening,
                       &a.shift, &a.turn_sensor, &a.turn_scene}) {
    *size = in.f64();
  }
  in.expectEnd();
  return a;
}

void readViewpoints(ByteReader& in, FrameAgreement& agreement) {
  const auto signed8 = [&in] { return static_cast<double>(static_cast<std::int8_t>(in.u8())); };
  const auto signed16 = [&in] { return static_cast<double>(static_cast<std::int16_t>(in.u16())); };
  const int count = in.u16();
  agreement.viewpoint_distance = static_cast<double>(in.f32());
  const double step = static_cast<double>(in.f32());
  for (int n = 0; n < count; ++n) {
    ViewpointAgreement v;
    for (int axis = 0; axis < 3; ++axis) v.viewpoint.position[axis] = step * signed16();
    for (int axis = 0; axis < 3; ++axis) v.viewpoint.view[axis] = signed8() / kViewSteps;
    v.frames = in.u8();
    v.ratio = std::exp2((in.u8() - kRatioMiddle) / kRatioSteps);
    agreement.viewpoints.push_back(v);
  }
  in.expectEnd();
}

}  // namespace ttsdf

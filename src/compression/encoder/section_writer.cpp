#include "section_writer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "../../map/format/map_container.h"
#include "../../map/format/map_sections.h"
#include "../../map/format/utf8.h"
#include "byte_compressor.h"

namespace ttsdf {

namespace {

void requireUtf8(const std::string& what, const std::string& text) {
  if (!isUtf8(text)) throw std::invalid_argument("map: got " + what + " with invalid bytes, wanted UTF-8");
}

}  // namespace

std::vector<std::uint8_t> writeContainer(const std::vector<Section>& sections) {
  std::size_t total = kHeaderBytes + kEntryBytes * sections.size();
  for (const Section& section : sections) total += section.payload.size();
  ByteWriter out;
  out.data().reserve(total);
  for (const std::uint8_t byte : kMagic) out.u8(byte);
  out.u32(kMapFormatVersion);
  out.u32(static_cast<std::uint32_t>(sections.size()));
  out.u64(total);
  out.u32(0);  // checksum, below
  out.u32(0);
  for (const Section& section : sections) {
    out.u32(section.id);
    out.u32(section.flags);
    out.u64(section.payload.size());
    out.u32(checksum(section.payload.data(), section.payload.size()));
    out.u32(0);
  }
  const std::uint32_t crc = headerChecksum(out.data().data(), out.size());
  for (std::size_t n = 0; n < 4; ++n) out.data()[kChecksumAt + n] = static_cast<std::uint8_t>(crc >> (8 * n));
  for (const Section& section : sections) out.bytes(section.payload);
  return std::move(out.data());
}

void writeGeometry(const GridGeometry& geometry, ByteWriter& out) {
  for (int axis = 0; axis < 3; ++axis) out.u32(static_cast<std::uint32_t>(geometry.dims[axis]));
  out.f64(geometry.voxel_size);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) out.f64(geometry.T_map_grid.matrix()(row, column));
  }
}

void writeField(const TtSdfMap& map, ByteWriter& out) {
  requireUtf8("a frame_id", map.frame_id);
  out.u8(static_cast<std::uint8_t>(map.kind));
  out.f64(map.truncation);
  out.f64(map.clamp_negative);
  out.f64(map.clamp_positive);
  out.string(map.frame_id);
}

void writeMetadata(const std::map<std::string, std::string>& metadata, ByteWriter& out) {
  ByteWriter text;
  text.u32(static_cast<std::uint32_t>(metadata.size()));
  for (const auto& [key, value] : metadata) {
    requireUtf8("a metadata key", key);
    requireUtf8("the metadata value of '" + key + "'", value);
    text.string(key);
    text.string(value);
  }
  if (text.size() > kMaxMetadataBytes) {
    throw std::invalid_argument("map: got " + std::to_string(text.size()) +
                                " bytes of metadata, wanted at most " + std::to_string(kMaxMetadataBytes));
  }
  out.u32(static_cast<std::uint32_t>(text.size()));
  out.block(compressBytes(text.data()));
}

void writeAgreement(const FrameAgreement& a, ByteWriter& out) {
  for (const int count : {a.compared, a.contradicting, a.without_overlap}) {
    out.u32(static_cast<std::uint32_t>(count));
  }
  for (const double size : {a.position_median, a.position_90, a.rotation_median, a.rotation_90, a.widening,
                            a.shift, a.turn_sensor, a.turn_scene}) {
    out.f64(size);
  }
}

void writeViewpoints(const FrameAgreement& a, ByteWriter& out) {
  if (a.viewpoints.size() > kMaxViewpoints) {
    throw std::invalid_argument("map: got " + std::to_string(a.viewpoints.size()) +
                                " viewpoints, wanted at most " + std::to_string(kMaxViewpoints));
  }
  double furthest = 0.0;
  for (const ViewpointAgreement& v : a.viewpoints)
    furthest = std::max(furthest, v.viewpoint.position.cwiseAbs().maxCoeff());
  // A place needs no more digits than this, unless the world is so large that they do not fit.
  const auto step = static_cast<float>(std::max(a.viewpoint_distance / 16.0, furthest / 32767.0));
  const auto rounded = [](double value, double low, double high) {
    return static_cast<int>(std::lround(std::clamp(value, low, high)));
  };
  out.u16(static_cast<std::uint16_t>(a.viewpoints.size()));
  out.f32(static_cast<float>(a.viewpoint_distance));
  out.f32(step);
  for (const ViewpointAgreement& v : a.viewpoints) {
    for (int axis = 0; axis < 3; ++axis) {
      out.u16(static_cast<std::uint16_t>(
          rounded(v.viewpoint.position[axis] / static_cast<double>(step), -32767.0, 32767.0)));
    }
    for (int axis = 0; axis < 3; ++axis)
      out.u8(static_cast<std::uint8_t>(rounded(kViewSteps * v.viewpoint.view[axis], -127.0, 127.0)));
    out.u8(static_cast<std::uint8_t>(std::clamp(v.frames, 1, 255)));
    out.u8(static_cast<std::uint8_t>(rounded(kRatioMiddle + kRatioSteps * std::log2(v.ratio), 0.0, 255.0)));
  }
}

}  // namespace ttsdf

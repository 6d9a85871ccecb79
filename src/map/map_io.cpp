#include "ttsdf_localization/map/map_io.h"

#include <iomanip>
#include <sstream>

#include "codec/mask_coding.h"
#include "format/encoding.h"
#include "format/map_container.h"
#include "format/map_sections.h"

namespace ttsdf {

const char* name(Encoding encoding) {
  switch (encoding) {
    case Encoding::kFloat16:
      return "float16";
    case Encoding::kQuantizedFirst:
      return "quantized-1";
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

TtSdfMap deserialize(const std::uint8_t* data, std::size_t size, const MapLimits& limits) {
  const Container container(data, size);
  TtSdfMap map;
  ByteReader geometry = container.section(kGeometrySection);
  map.geometry = readGeometry(geometry, limits.max_voxels);
  ByteReader field = container.section(kFieldSection);
  readField(field, map);
  try {
    check(map.geometry);
    if (container.has(kMaskSection)) {
      ByteReader mask = container.section(kMaskSection);
      map.mask = readMask(mask, map.geometry.dims, limits.max_megabytes);
      mask.expectEnd();
    }
    if (container.has(kMetadataSection)) {
      ByteReader metadata = container.section(kMetadataSection);
      map.metadata = readMetadata(metadata);
    }
    if (container.has(kAgreementSection)) {
      ByteReader agreement = container.section(kAgreementSection);
      map.agreement = readAgreement(agreement);
      if (container.has(kViewpointSection)) {
        ByteReader viewpoints = container.section(kViewpointSection);
        readViewpoints(viewpoints, map.agreement);
      }
    }
    ByteReader cores = container.section(kCoreSection);
    map.train = readCores(cores, map.geometry.dims, limits.max_megabytes);
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

#pragma once
// The map file: magic, version, sections with sizes and checksums (doc/map_format.md). The same bytes travel
// in the ROS message, so a service reply is checked exactly as a file is.

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "ttsdf_localization/files/file_writer.h"
#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

/// The bytes are no usable map; the message says what, got, wanted.
class MapFormatError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// kQuantizedFirst is how quantized cores were written at first: it is read for ever and no longer written.
enum class Encoding : std::uint8_t { kFloat32 = 0, kFloat16 = 1, kQuantizedFirst = 2, kQuantized = 3 };

const char* name(Encoding encoding);            ///< "float32" | "float16" | "quantized-1" | "quantized"
Encoding encodingFromName(const std::string&);  ///< throws std::invalid_argument

/// What reading a map may cost, whatever its bytes claim.
struct MapLimits {
  double max_megabytes = 256.0;  ///< of everything that is decoded, at the same time
  double max_voxels = 4e9;       ///< of the grid: what is made of a map takes time with them
};

/// Throws MapFormatError. Takes memory and time in proportion to the bytes that are coded: cores of more than
/// 2^16 numbers and 2^10 more per coded byte are refused, as is what exceeds the limits.
TtSdfMap deserialize(const std::uint8_t* data, std::size_t size, const MapLimits& limits = {});

struct MapFileInfo {
  Encoding encoding = Encoding::kFloat32;
  std::size_t file_bytes = 0;
  std::string map_id;  ///< 8 hex digits, CRC-32 of the whole file: equal bytes, equal id
};

/// Checks the container and reads the first field of the cores, nothing else. Throws MapFormatError.
MapFileInfo fileInfo(const std::uint8_t* data, std::size_t size);

/// Of every map file; saveMap replaces nothing else.
extern const FileKind kMapFile;

/// Throws std::runtime_error (cannot read) or MapFormatError.
TtSdfMap loadMap(const std::string& path, const MapLimits& limits = {});
/// Whole file; throws std::runtime_error naming the path, also for files above `max_bytes`.
std::vector<std::uint8_t> readFile(const std::string& path, std::size_t max_bytes = std::size_t{1} << 30);

}  // namespace ttsdf

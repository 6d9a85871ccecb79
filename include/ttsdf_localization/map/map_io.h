#pragma once
// The map file: magic, version, sections with sizes and checksums (doc/map_format.md). The same bytes travel in the
// ROS message, so a service reply is checked exactly as a file is.

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

/// The bytes are no usable map; the message says what, got, wanted.
class MapFormatError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class Encoding : std::uint8_t { kFloat32 = 0, kFloat16 = 1, kQuantized = 2 };

const char* name(Encoding encoding);              ///< "float32" | "float16" | "quantized"
Encoding encodingFromName(const std::string&);    ///< throws std::invalid_argument

struct EncodeOptions {
  Encoding encoding = Encoding::kFloat32;
  /// kQuantized only: error budget as rms of the quantisation of the full array [m]; 0: a default well below the error of the ranks.
  double quantization_rms = 0.0;
};

/// Throws std::invalid_argument if check(map) fails.
std::vector<std::uint8_t> serialize(const TtSdfMap& map, const EncodeOptions& options = {});
/// Throws MapFormatError; never allocates more than the checked header allows.
TtSdfMap deserialize(const std::uint8_t* data, std::size_t size);

struct MapFileInfo {
  Encoding encoding = Encoding::kFloat32;
  std::size_t file_bytes = 0;
  std::string map_id;  ///< 8 hex digits, CRC-32 of the whole file: equal bytes, equal id
};

MapFileInfo fileInfo(const std::uint8_t* data, std::size_t size);  ///< throws MapFormatError

/// Writes to a temporary neighbour and renames: an interrupted save leaves the old file. Throws std::runtime_error.
void saveMap(const TtSdfMap& map, const std::string& path, const EncodeOptions& options = {});
/// Throws std::runtime_error (cannot read) or MapFormatError.
TtSdfMap loadMap(const std::string& path);
/// Whole file; throws std::runtime_error naming the path, also for files above `max_bytes`.
std::vector<std::uint8_t> readFile(const std::string& path, std::size_t max_bytes = std::size_t{1} << 30);
void writeFileAtomically(const std::string& path, const std::vector<std::uint8_t>& bytes);

}  // namespace ttsdf

#pragma once
// The map file: magic, version, sections with sizes and checksums (doc/map_format.md). The same bytes travel
// in the ROS message, so a service reply is checked exactly as a file is.

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

const char* name(Encoding encoding);            ///< "float32" | "float16" | "quantized"
Encoding encodingFromName(const std::string&);  ///< throws std::invalid_argument

/// How the cores are written. kQuantized takes its coarseness from the first of target_bytes,
/// quantization_step and quantization_rms that is not 0; the other encodings look at none of them.
struct EncodeOptions {
  Encoding encoding = Encoding::kFloat32;
  /// Error budget as rms of the quantisation over the full array [m]; kept, and checked on the result. 0: a
  /// tenth of a voxel, well below what ranks up to 100 leave.
  double quantization_rms = 0.0;
  /// Step of the middle core's coefficients [m]; for trains that were fitted for it (compactMap).
  double quantization_step = 0.0;
  /// The finest quantisation whose whole file has at most so many bytes.
  std::size_t target_bytes = 0;
};

/// Throws std::invalid_argument if check(map) fails, for ranks above what the mode sizes allow (round the
/// train first), for text that is no UTF-8, for entries that float16 cannot hold and for a target_bytes out
/// of reach.
std::vector<std::uint8_t> serialize(const TtSdfMap& map, const EncodeOptions& options = {});
/// Bytes of the file that serialize would make. Exact, and as expensive.
std::size_t encodedSize(const TtSdfMap& map, const EncodeOptions& options);
/// Throws MapFormatError; never allocates more than what the checked sizes justify (cores of at most 2^26
/// numbers).
TtSdfMap deserialize(const std::uint8_t* data, std::size_t size);

struct MapFileInfo {
  Encoding encoding = Encoding::kFloat32;
  std::size_t file_bytes = 0;
  std::string map_id;  ///< 8 hex digits, CRC-32 of the whole file: equal bytes, equal id
};

/// Checks the container and reads the first field of the cores, nothing else. Throws MapFormatError.
MapFileInfo fileInfo(const std::uint8_t* data, std::size_t size);

/// Writes to a temporary neighbour and renames: an interrupted save leaves the old file. Throws
/// std::runtime_error.
void saveMap(const TtSdfMap& map, const std::string& path, const EncodeOptions& options = {});
/// Throws std::runtime_error (cannot read) or MapFormatError.
TtSdfMap loadMap(const std::string& path);
/// Whole file; throws std::runtime_error naming the path, also for files above `max_bytes`.
std::vector<std::uint8_t> readFile(const std::string& path, std::size_t max_bytes = std::size_t{1} << 30);
/// Temporary neighbour, fsync, rename. Throws std::runtime_error naming the path; the old file stays.
void writeFileAtomically(const std::string& path, const std::vector<std::uint8_t>& bytes);

}  // namespace ttsdf

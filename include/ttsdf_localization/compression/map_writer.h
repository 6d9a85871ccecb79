#pragma once
// Map files are written by those who build maps; who localizes only reads them (map/map_io.h).

#include <cstdint>
#include <string>
#include <vector>

#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

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
/// Writes to a temporary neighbour and renames: an interrupted save leaves the old file. Throws
/// std::runtime_error.
void saveMap(const TtSdfMap& map, const std::string& path, const EncodeOptions& options = {});

}  // namespace ttsdf

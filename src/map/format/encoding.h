#pragma once
// The cores of the train as bytes: the section 'CORE' of the map file.

#include "byte_io.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

/// The train of a grid of `dims` voxels. Throws MapFormatError before it allocates anything that the checked
/// sizes do not justify.
TensorTrain readCores(ByteReader& in, const Dims& dims, double max_megabytes);

/// The first field of the section.
Encoding readEncoding(ByteReader& in);

/// What every encoding begins with: which axis is which mode, and the ranks.
struct CoreHeader {
  Encoding encoding = Encoding::kFloat32;
  ModeOrder axes{};
  std::array<int, 3> sizes{};  ///< n1, n2, n3
  int rank1 = 0, rank2 = 0;

  std::size_t firstCount() const { return count(sizes[0], rank1); }
  std::size_t middleCount() const { return count(rank1, rank2) * static_cast<std::size_t>(sizes[1]); }
  std::size_t lastCount() const { return count(rank2, sizes[2]); }
  std::size_t parameterCount() const { return firstCount() + middleCount() + lastCount(); }

 private:
  static std::size_t count(int a, int b) { return static_cast<std::size_t>(a) * static_cast<std::size_t>(b); }
};

/// Empty if the ranks can be those of a train of these extents, else what they should be.
std::string wantedRanks(const CoreHeader& header);
std::string ranksText(const CoreHeader& header);

}  // namespace ttsdf

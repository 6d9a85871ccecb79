#pragma once
// From a fused volume or a mesh to a compressed map, with a report. No OpenVDB in this header: the ROS layer
// and the tools include it.

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "ttsdf_localization/field/support_mask.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/map/tt_sdf_map.h"
#include "ttsdf_localization/mapping/tsdf_volume.h"
#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct BuildOptions {
  std::string field = "sdf";           ///< sdf | tsdf
  std::string sdf_method = "surface";  ///< surface (observed zero crossings) | occupancy_edt (the paper's)
  std::string max_rank = "40";         ///< "R" or "R1,R2"; "0": none
  double tolerance = 0.0;              ///< relative Frobenius error; 0: ranks only
  int refine_iterations = 30;          ///< weighted sweeps after TT-SVD; 0: plain TT-SVD
  double quantization =
      0.0;  ///< coarseness of the quantized encoding [m]; 0: half of the ranks' error near the surface
  std::string encoding = "quantized";  ///< float32 | float16 | quantized
  int target_bytes = 0;                ///< file size to reach by choice of ranks and encoding; 0: off
  double target_surface_error = 0.0;   ///< rms error within 3 cm of the surface to reach [m]; 0: off
  double clamp_negative = 0.06;        ///< [m]; 0: not clamped
  double clamp_positive = 0.2;         ///< [m]; 0: not clamped
  bool align_axes = true;              ///< turn the grid so that dominant planes follow its axes
  bool support_mask = true;
  double support_distance = 0.04;  ///< sideways distance from observed surface that still counts as known [m]
  double margin = 0.2;             ///< box border around the observed surface [m]
  int max_dense_voxels = 30000000;  ///< larger grids are sampled in tiles: less memory, a little more time
  int threads = 2;
};
const OptionTable<BuildOptions>& buildOptionTable();
/// Throws std::invalid_argument for what cannot be built: to be asked before hours of fusion.
void validate(const BuildOptions& options);

/// Caps on the ranks; 0: none.
struct RankCaps {
  int r1 = 0, r2 = 0;
};
/// Of BuildOptions::max_rank. Throws std::invalid_argument for another text.
RankCaps parseRanks(const std::string& text);

class FieldBricks;

/// The uncompressed signed field that compression starts from (and that baselines use).
struct SampledField {
  DenseTensor values;  ///< [m]
  std::vector<std::uint8_t>
      known;  ///< per voxel: 1 where some ray saw it (free or band); same order as values
  /// In place of values and known (then empty) on grids whose dense arrays would be too large; made by tiles.
  std::shared_ptr<const FieldBricks> bricks;
  GridGeometry geometry;
  SupportMask mask;
  std::string frame_id = "map";  ///< the map's frame
};

struct BuildReport {
  std::map<std::string, double> seconds;  ///< per step
  double relative_error = 0.0;            ///< |F - TT| / |F|
  double surface_rms = 0.0;               ///< rms error of known voxels within 3 cm of the surface [m]
  double observed_share = 0.0;            ///< of the box
  std::size_t frames = 0, file_bytes = 0, memory_bytes = 0, dense_bytes = 0;
  int rank1 = 0, rank2 = 0;
  std::string encoding;
};
/// JSON object with every figure of the report.
std::string toJson(const BuildReport& report);

struct BuiltMap {
  TtSdfMap map;                     ///< as a reader of `bytes` would see it
  std::vector<std::uint8_t> bytes;  ///< the encoded file
  BuildReport report;
};

/// Called with a step's name and the share done [0, 1]; returns false to cancel (std::runtime_error
/// "cancelled").
using BuildProgress = std::function<bool(const std::string& step, double share)>;

/// Signed distance over the volume's box as the options say. Throws std::runtime_error if nothing was
/// observed.
SampledField sampleField(const TsdfVolume& volume, const BuildOptions& options,
                         const BuildProgress& progress = {});
/// Compression of a sampled field.
BuiltMap compress(const SampledField& field, const FusionOptions& fusion, const BuildOptions& options,
                  const BuildProgress& progress = {});
/// Both.
BuiltMap buildMap(const TsdfVolume& volume, const BuildOptions& options, const BuildProgress& progress = {});

}  // namespace ttsdf

#pragma once
// What every step of building a map shares: the options, and word of how far it is.

#include <functional>
#include <string>

#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct BuildOptions {
  std::string field = "sdf";           ///< sdf | tsdf
  std::string sdf_method = "surface";  ///< surface (observed zero crossings) | occupancy_edt... (the paper's)
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

/// Called with a step's name and the share done [0, 1]; returns false to cancel (std::runtime_error
/// "cancelled").
using BuildProgress = std::function<bool(const std::string& step, double share)>;

}  // namespace ttsdf

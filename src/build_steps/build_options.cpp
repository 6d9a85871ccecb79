#include "ttsdf_localization/build_steps/build_options.h"

#include <regex>
#include <stdexcept>

namespace ttsdf {

const OptionTable<BuildOptions>& buildOptionTable() {
  using O = BuildOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("field", &O::field, {"sdf", "tsdf"},
               "Distance over the whole box, or the fused truncated distance")
          .add("sdf_method", &O::sdf_method,
               {"surface", "occupancy_edt", "occupancy_edt_signed", "occupancy_edt_negative"},
               "Distance to the observed surface, or the paper's distance transform of occupied voxels: "
               "those at "
               "zero crossings, without a sign or with it, or all behind surfaces")
          .add("max_rank", &O::max_rank, {}, "Largest TT-ranks: R or R1,R2; 0: no cap")
          .add("tolerance", &O::tolerance, 0.0, 1.0, "",
               "Relative error of the compression allowed; 0: ranks only")
          .add("refine_iterations", &O::refine_iterations, 0, 1000, "",
               "Sweeps that fit the train to what matters (near the surface, where the map knows); 0: plain "
               "TT-SVD")
          .add("encoding", &O::encoding, {"float32", "float16", "quantized"}, "How the cores are stored")
          .add("quantization", &O::quantization, 0.0, 0.1, "m",
               "Coarseness of the quantized encoding: what changes the field by less is not stored; 0: half "
               "of the error that the ranks leave near the surface")
          .add("target_bytes", &O::target_bytes, 0, 2000000000, "byte",
               "Choose the ranks for a file of at most this size (max_rank is not used); 0: off")
          .add(
              "target_surface_error", &O::target_surface_error, 0.0, 1.0, "m",
              "Choose the ranks for this rms error within 3 cm of the surface (max_rank is not used); 0: off")
          .add("clamp_negative", &O::clamp_negative, 0.0, 100.0, "m",
               "Distances behind surfaces end here; 0: never")
          .add("clamp_positive", &O::clamp_positive, 0.0, 100.0, "m",
               "Distances in free space end here; 0: never")
          .add("align_axes", &O::align_axes, "Turn the grid so that dominant planes follow its axes")
          .add("support_mask", &O::support_mask, "Store where the map knows nothing")
          .add("support_distance", &O::support_distance, 0.0, 10.0, "m",
               "How far sideways of an observed surface the map still knows something")
          .add("margin", &O::margin, 0.0, 100.0, "m", "Border of the box around the observed surface")
          .add("max_dense_voxels", &O::max_dense_voxels, 0, 2000000000, "voxel",
               "Grids of more voxels are sampled in tiles and kept in about a byte per voxel (needs both "
               "clamps "
               "and sdf_method surface); smaller ones in dense arrays, at up to 40 bytes per voxel")
          .add("threads", &O::threads, 1, 256, "", "Threads");
  return table;
}

RankCaps parseRanks(const std::string& text) {
  static const std::regex kPattern(R"(\s*(\d{1,9})\s*(,\s*(\d{1,9})\s*)?)");
  std::smatch match;
  if (!std::regex_match(text, match, kPattern)) {
    throw std::invalid_argument("option 'max_rank': got '" + text + "', wanted R or R1,R2 (0: no cap)");
  }
  const int r1 = std::stoi(match[1]);
  return {r1, match[3].matched ? std::stoi(match[3]) : r1};
}

void validate(const BuildOptions& options) {
  buildOptionTable().validate(options);
  if (options.target_bytes > 0 && options.target_surface_error > 0.0) {
    throw std::invalid_argument(
        "options 'target_bytes' and 'target_surface_error': got both, wanted one of them");
  }
  parseRanks(options.max_rank);
}

}  // namespace ttsdf

#pragma once
// From a fused volume or a mesh to a compressed map, with a report. No OpenVDB in this header: the ROS layer
// and the tools include it.

#include <map>
#include <string>
#include <vector>

#include "ttsdf_localization/build_steps/build_options.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/map/tt_sdf_map.h"
#include "ttsdf_localization/signed_field/sampled_field.h"

namespace ttsdf {

struct BuildReport {
  std::map<std::string, double> seconds;  ///< per step
  double relative_error = 0.0;            ///< |F - TT| / |F|
  double surface_rms = 0.0;               ///< rms error of known voxels within 3 cm of the surface [m]
  double observed_share = 0.0;            ///< of the box
  std::size_t frames = 0, file_bytes = 0, memory_bytes = 0, dense_bytes = 0;
  int rank1 = 0, rank2 = 0;
  std::string encoding;
  FrameAgreement agreement;  ///< of the frames, if it was measured
};
/// JSON object with every figure of the report.
std::string toJson(const BuildReport& report);

struct BuiltMap {
  TtSdfMap map;                     ///< as a reader of `bytes` would see it
  std::vector<std::uint8_t> bytes;  ///< the encoded file
  BuildReport report;
};

/// Compression of a sampled field.
BuiltMap compress(const SampledField& field, const FusionOptions& fusion, const BuildOptions& options,
                  const BuildProgress& progress = {});
/// Both. `agreement` of the volume's frames (agreement/frame_comparison.h) becomes part of the map.
BuiltMap buildMap(const TsdfVolume& volume, const BuildOptions& options, const BuildProgress& progress = {},
                  const FrameAgreement& agreement = {});

}  // namespace ttsdf

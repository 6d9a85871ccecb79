#include <iomanip>
#include <sstream>

#include "ttsdf_localization/mapping/map_builder.h"

namespace ttsdf {

namespace {

/// "unknown" has no number.
void writeAgreement(std::ostream& out, const FrameAgreement& a) {
  if (!a.known()) {
    out << "\"frame_agreement_m\": null,\n  \"frame_agreement_rad\": null";
  } else {
    out << "\"frame_agreement_m\": " << a.position_median
        << ",\n  \"frame_agreement_rad\": " << a.rotation_median
        << ",\n  \"frame_agreement_90_m\": " << a.position_90
        << ",\n  \"frame_agreement_90_rad\": " << a.rotation_90;
  }
  out << ",\n  \"frames_compared\": " << a.compared << ",\n  \"frames_contradicting\": " << a.contradicting
      << ",\n  \"frames_without_overlap\": " << a.without_overlap;
}

}  // namespace

std::string toJson(const BuildReport& report) {
  std::ostringstream out;
  out << std::setprecision(6) << "{\n  \"frames\": " << report.frames << ",\n  \"rank1\": " << report.rank1
      << ",\n  \"rank2\": " << report.rank2 << ",\n  \"encoding\": \"" << report.encoding
      << "\",\n  \"relative_error\": " << report.relative_error
      << ",\n  \"surface_rms\": " << report.surface_rms
      << ",\n  \"observed_share\": " << report.observed_share << ",\n  \"file_bytes\": " << report.file_bytes
      << ",\n  \"memory_bytes\": " << report.memory_bytes << ",\n  \"dense_bytes\": " << report.dense_bytes
      << ",\n  ";
  writeAgreement(out, report.agreement);
  out << ",\n  \"seconds\": {";
  const char* separator = "";
  for (const auto& [step, seconds] : report.seconds) {
    out << separator << "\n    \"" << step << "\": " << seconds;
    separator = ",";
  }
  out << "\n  }\n}\n";
  return out.str();
}

}  // namespace ttsdf

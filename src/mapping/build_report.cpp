#include <iomanip>
#include <sstream>

#include "ttsdf_localization/mapping/map_builder.h"

namespace ttsdf {

std::string toJson(const BuildReport& report) {
  std::ostringstream out;
  out << std::setprecision(6) << "{\n  \"frames\": " << report.frames << ",\n  \"rank1\": " << report.rank1
      << ",\n  \"rank2\": " << report.rank2 << ",\n  \"encoding\": \"" << report.encoding
      << "\",\n  \"relative_error\": " << report.relative_error
      << ",\n  \"surface_rms\": " << report.surface_rms
      << ",\n  \"observed_share\": " << report.observed_share << ",\n  \"file_bytes\": " << report.file_bytes
      << ",\n  \"memory_bytes\": " << report.memory_bytes << ",\n  \"dense_bytes\": " << report.dense_bytes
      << ",\n  \"seconds\": {";
  const char* separator = "";
  for (const auto& [step, seconds] : report.seconds) {
    out << separator << "\n    \"" << step << "\": " << seconds;
    separator = ",";
  }
  out << "\n  }\n}\n";
  return out.str();
}

}  // namespace ttsdf

#include "ros/demo/demo_report.h"

#include <algorithm>
#include <iomanip>
#include <sstream>

#include "ttsdf_localization/evaluation/statistics.h"

namespace ttsdf {

namespace {

constexpr double kLeastShare = 0.95, kLargestRmse = 0.03;

/// Of the scans that the localizer looked at: those that a slow machine drops say nothing about localization.
double share(const DemoReport& report) {
  const std::uint32_t taken = report.scans - std::min(report.dropped, report.scans);
  return taken > 0 ? static_cast<double>(report.localised) / taken : 0.0;
}

double perSecond(double count, double seconds) { return seconds > 0.0 ? count / seconds : 0.0; }

void writeMapping(std::ostream& out, const DemoReport& r) {
  out << "  mapping         " << r.scans_fused << " scans in " << r.mapping_seconds << " s of driving\n";
  out << "  map             ";
  for (std::size_t i = 0; i < r.dims.size(); ++i) out << (i > 0 ? " x " : "") << r.dims[i];
  out << " voxels, ranks";
  for (const std::uint32_t rank : r.ranks) out << ' ' << rank;
  out << ", " << r.encoding << ", built in " << r.build_seconds << " s\n";
  out << "  map file        " << 1e-3 * static_cast<double>(r.map_bytes) << " kB; dense array "
      << 1e-6 * static_cast<double>(r.dense_bytes) << " MB (" << std::setprecision(0)
      << (r.map_bytes > 0 ? static_cast<double>(r.dense_bytes) / static_cast<double>(r.map_bytes) : 0.0)
      << " times the file)" << std::setprecision(1) << "; compression error at the surface "
      << 1e3 * r.surface_rms << " mm\n";
}

void writeStatistics(std::ostream& out, const char* label, const ErrorStatistics& e, double scale,
                     const char* unit) {
  out << label << "rmse " << scale * e.rmse << ", median " << scale * e.median << ", max " << scale * e.max
      << ' ' << unit << '\n';
}

void writeTimes(std::ostream& out, const char* label, const std::vector<double>& ms) {
  if (ms.empty()) return;
  out << label << "median " << quantile(ms, 0.5) << ", 99 % within " << quantile(ms, 0.99) << " ms\n";
}

}  // namespace

std::vector<std::string> problems(const DemoReport& report) {
  std::vector<std::string> found;
  std::ostringstream text;
  text << std::fixed << std::setprecision(1);
  const auto add = [&] {
    found.push_back(text.str());
    text.str("");
  };
  if (report.map_bytes == 0) {
    text << "no map was built and saved";
    add();
  }
  if (share(report) < kLeastShare) {
    text << "got poses for " << 100.0 * share(report) << " % of the scans, wanted " << 100.0 * kLeastShare
         << " %";
    add();
  }
  if (report.estimate.empty() || report.truth.empty()) {
    text << "got no pose to compare with the truth";
    add();
    return found;
  }
  const double rmse = absoluteTrajectoryError(report.estimate, report.truth).translation.rmse;
  if (!(rmse <= kLargestRmse)) {
    text << "got an rms error of " << 1e3 * rmse << " mm, wanted at most " << 1e3 * kLargestRmse << " mm";
    add();
  }
  return found;
}

std::string toText(const DemoReport& r) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(1);
  out << "ttsdf_localization demo\n";
  writeMapping(out, r);
  out << "  localization    " << r.localised << " of " << r.scans - std::min(r.dropped, r.scans)
      << " scans localised (" << 100.0 * share(r) << " %), " << perSecond(r.localised, r.localization_seconds)
      << " scans/s over " << r.localization_seconds << " s; " << r.dropped << " dropped, " << r.times_lost
      << " times lost\n";
  if (r.dropped > r.scans / 10) {
    out << "  note            this machine is too slow for every scan: " << r.dropped
        << " were overtaken by newer ones and do not count above\n";
  }
  if (!r.estimate.empty() && !r.truth.empty()) {
    const TrajectoryError error = absoluteTrajectoryError(r.estimate, r.truth);
    writeStatistics(out, "  position error  ", error.translation, 1e3, "mm");
    writeStatistics(out, "  rotation error  ", error.rotation, 1e3, "mrad");
    out << "  odometry alone  " << 1e3 * r.odometry_error << " mm off in the end\n";
  }
  writeTimes(out, "  registration    ", r.registration_ms);
  writeTimes(out, "  latency         ", r.latency_ms);
  out << "  total time      " << r.total_seconds << " s\n";
  for (const std::string& problem : problems(r)) out << "FAILED: " << problem << '\n';
  return out.str();
}

}  // namespace ttsdf

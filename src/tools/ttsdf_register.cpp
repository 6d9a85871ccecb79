// Registers a list of scans against a map.

#include <chrono>
#include <fstream>
#include <iostream>

#include "ttsdf_localization/evaluation/method.h"
#include "ttsdf_localization/evaluation/statistics.h"
#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/localization/pose_covariance.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/json_file.h"
#include "ttsdf_localization/tools/map_memory.h"
#include "ttsdf_localization/tools/progress.h"
#include "ttsdf_localization/tools/scan_io.h"

namespace {

struct Arguments {
  std::string map, batch, output, uncertainty, report, mode = "track", gravity, map_down,
                                                       interpolation = "trilinear", prior_sigma;
  int repeat = 1;
  bool dense = false;
  double memory_megabytes = ttsdf::TtFieldOptions().memory_megabytes;
  ttsdf::RegistrationOptions registration;
  ttsdf::SearchOptions search;
  ttsdf::GlobalOptions global;
};

void declare(ttsdf::CommandLine& line, Arguments& a) {
  line.value("map", "MAP.ttsdf", a.map, "The map.")
      .value("batch", "LIST", a.batch,
             "Per line: scan prior [truth]. Scan: .pcd, .ply or .bin (float32 x y z); prior and truth: text "
             "files with a "
             "4x4 row-major T_map_sensor. Names are relative to the working folder or to the list's.")
      .value("output", "OUT.csv", a.output, "One row per line of the list.")
      .value("uncertainty", "OUT.csv", a.uncertainty,
             "Also the covariance of every estimate and its number of weak directions.")
      .value("mode", "MODE", a.mode,
             "track: one start; search: many starts around the prior; global: no prior ('-').")
      .value("gravity", "GX,GY,GZ", a.gravity, "Down direction in the sensor frame (mode global).")
      .value("map-down", "X,Y,Z", a.map_down,
             "Down direction in the map frame (mode global; default: 0,0,-1).")
      .value("prior-sigma", "METRES,RADIANS", a.prior_sigma,
             "Standard deviations of the priors: along directions that a scan does not fix the answer is the "
             "prior, and success tells whether that is good enough. Without it the priors count little.")
      .value("repeat", "N", a.repeat, "The time of a scan is the median of N registrations.")
      .value("interpolation", "KIND", a.interpolation, "trilinear, or nearest as in the paper.")
      .value("report", "OUT.json", a.report,
             "Memory of the map by part and of the process [bytes], load_seconds, median_ms and p99_ms.")
      .value("memory-megabytes", "N", a.memory_megabytes,
             "Bound on what the map takes in memory, everything counted; less is slower.")
      .flag("dense", a.dense, "Uses the decompressed field, for comparison.")
      .options("registration", ttsdf::registrationOptionTable(), a.registration)
      .options("search", ttsdf::searchOptionTable(), a.search)
      .options("global", ttsdf::globalOptionTable(), a.global);
}

void check(const Arguments& a) {
  if (a.map.empty()) throw ttsdf::UsageError("--map is missing");
  if (a.batch.empty()) throw ttsdf::UsageError("--batch is missing");
  if (a.output.empty()) throw ttsdf::UsageError("--output is missing");
  if (a.repeat < 1)
    throw ttsdf::UsageError("--repeat: got " + std::to_string(a.repeat) + ", wanted at least 1");
  if (a.mode != "track" && a.mode != "search" && a.mode != "global") {
    throw ttsdf::UsageError("--mode: got '" + a.mode + "', wanted track, search or global");
  }
}

Eigen::Vector3d direction(const std::string& flag, const std::string& text) {
  const auto numbers = ttsdf::parseNumbers(flag, text, 3);
  const Eigen::Vector3d result(numbers[0], numbers[1], numbers[2]);
  if (!(result.norm() > 1e-9))
    throw ttsdf::UsageError("--" + flag + ": got '" + text + "', wanted a direction");
  return result.normalized();
}

std::optional<ttsdf::Matrix6d> priorCovariance(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto sigmas = ttsdf::parseNumbers("prior-sigma", text, 2);
  if (!(sigmas[0] > 0.0) || !(sigmas[1] > 0.0))
    throw ttsdf::UsageError("--prior-sigma: got '" + text + "', wanted two numbers above 0");
  return ttsdf::isotropicCovariance(sigmas[1], sigmas[0]);
}

/// One registration of the chosen mode.
class Task {
 public:
  Task(const Arguments& a, const ttsdf::TtSdfMap& map)
      : arguments_(a),
        registration_(makeField(a, map), a.registration),
        prior_covariance_(priorCovariance(a.prior_sigma)) {
    if (!a.gravity.empty()) gravity_ = direction("gravity", a.gravity);
    if (!a.map_down.empty()) map_down_ = direction("map-down", a.map_down);
  }

  ttsdf::RegistrationResult run(const ttsdf::ScanPoints& points, const Eigen::Isometry3d& T_map_prior) {
    if (arguments_.mode == "global") {
      return ttsdf::localizeGlobally(registration_, points, gravity_, map_down_, arguments_.global);
    }
    if (arguments_.mode == "search") {
      return ttsdf::searchNear(registration_, points, T_map_prior, arguments_.search, prior_covariance_);
    }
    return registration_.align(points, T_map_prior, prior_covariance_);
  }

  Json::Value memory() const {
    return ttsdf::memoryByPart(registration_.field(), registration_.longRangeField().get());
  }

 private:
  static std::shared_ptr<const ttsdf::DistanceField> makeField(const Arguments& a,
                                                               const ttsdf::TtSdfMap& map) {
    return ttsdf::makeEvaluationField(map, ttsdf::interpolationFromName(a.interpolation), a.dense,
                                      a.memory_megabytes);
  }

  const Arguments& arguments_;
  ttsdf::Registration registration_;
  std::optional<ttsdf::Matrix6d> prior_covariance_;
  std::optional<Eigen::Vector3d> gravity_;
  Eigen::Vector3d map_down_{0.0, 0.0, -1.0};
};

ttsdf::RegistrationRow registerEntry(const Arguments& a, Task& task, const ttsdf::BatchEntry& entry) {
  const auto path = [&a](const std::string& name) { return ttsdf::resolveBeside(a.batch, name); };
  ttsdf::RegistrationRow row;
  row.scan = entry.scan;
  row.prior = entry.prior;
  const auto points = ttsdf::readScan(path(entry.scan));
  row.points = points.array().isFinite().colwise().all().count();
  Eigen::Isometry3d T_map_prior = Eigen::Isometry3d::Identity();
  if (a.mode != "global") T_map_prior = ttsdf::readPose(path(entry.prior));
  std::optional<Eigen::Isometry3d> truth;
  if (entry.truth) truth = ttsdf::readPose(path(*entry.truth));
  std::vector<double> milliseconds;
  for (int n = 0; n < a.repeat; ++n) {
    const auto start = std::chrono::steady_clock::now();
    row.result = task.run(points, T_map_prior);
    milliseconds.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  row.milliseconds = ttsdf::quantile(milliseconds, 0.5);
  if (truth) row.error = ttsdf::poseError(*truth, row.result.T_map_sensor);
  return row;
}

double secondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

int run(int argc, char** argv) {
  Arguments a;
  ttsdf::CommandLine line("ttsdf_register", "--map MAP.ttsdf --batch LIST --output OUT.csv [options]",
                          "Registers scans against a map.");
  declare(line, a);
  if (!line.parse(argc, argv, std::cout)) return 0;
  check(a);
  const auto entries = ttsdf::readBatch(a.batch);
  ttsdf::Progress progress("ttsdf_register");
  const ttsdf::ResidentMemory before = ttsdf::residentMemory();
  const auto loading = std::chrono::steady_clock::now();
  Task task(a, ttsdf::loadMap(a.map));
  const double load_seconds = secondsSince(loading);
  const ttsdf::ResidentMemory loaded = ttsdf::residentMemory();
  const std::size_t peak_loaded = ttsdf::peakResidentBytes();
  ttsdf::OutputFile out_file(a.output), uncertainty_file(a.uncertainty), report_file(a.report);
  std::ostream &out = out_file.stream(), &uncertainty = uncertainty_file.stream();
  out << ttsdf::kRegistrationCsvHeader << '\n';
  if (!a.uncertainty.empty()) ttsdf::writeUncertaintyHeader(uncertainty);
  std::vector<double> milliseconds;
  std::string first_error;
  std::size_t unreadable = 0;
  for (std::size_t n = 0; n < entries.size(); ++n) {
    progress.update("registering", static_cast<double>(n) / static_cast<double>(entries.size()));
    ttsdf::RegistrationRow row;
    try {
      row = registerEntry(a, task, entries[n]);
    } catch (
        const std::runtime_error& error) {  // the row says so, the other scans go on, the exit code tells
      if (unreadable++ == 0) first_error = error.what();
      row.scan = entries[n].scan;
      row.prior = entries[n].prior;
      row.unreadable = true;
    }
    ttsdf::writeRow(out, row);
    if (!row.unreadable) milliseconds.push_back(row.milliseconds);
    if (!a.uncertainty.empty()) ttsdf::writeUncertainty(uncertainty, row);
  }
  if (!a.report.empty()) {
    Json::Value report = task.memory();
    const auto added = [](std::size_t from, std::size_t to) {
      return static_cast<Json::Int64>(to) - static_cast<Json::Int64>(from);
    };
    report["resident_before_bytes"] = static_cast<Json::UInt64>(before.all);
    report["resident_loaded_bytes"] = static_cast<Json::UInt64>(loaded.all);
    report["resident_added_bytes"] = added(before.all, loaded.all);
    report["data_added_bytes"] = added(before.data, loaded.data);
    report["peak_rss_loaded_bytes"] = static_cast<Json::UInt64>(peak_loaded);
    report["peak_rss_bytes"] = static_cast<Json::UInt64>(ttsdf::peakResidentBytes());
    report["load_seconds"] = load_seconds;
    report["scans"] = static_cast<Json::UInt64>(milliseconds.size());
    if (!milliseconds.empty()) {
      report["median_ms"] = ttsdf::quantile(milliseconds, 0.5);
      report["p99_ms"] = ttsdf::quantile(milliseconds, 0.99);
    }
    report_file.stream() << ttsdf::toText(report);
  }
  out_file.close();
  uncertainty_file.close();
  report_file.close();
  if (unreadable > 0) {
    throw std::runtime_error(std::to_string(unreadable) + " of " + std::to_string(entries.size()) +
                             " entries could not be read; first: " + first_error);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("ttsdf_register", [&] { return run(argc, argv); });
}

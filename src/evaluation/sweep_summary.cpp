#include <algorithm>
#include <cstdio>
#include <limits>
#include <map>
#include <tuple>

#include "ttsdf_localization/evaluation/sweep.h"

namespace ttsdf {

namespace {

// Position of a text in the order of first appearance.
int orderOf(const std::string& text, std::vector<std::string>& seen) {
  const auto found = std::find(seen.begin(), seen.end(), text);
  const auto position = static_cast<int>(found - seen.begin());
  if (found == seen.end()) seen.push_back(text);
  return position;
}

Quartiles quartilesOrNan(const std::vector<double>& values) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  return values.empty() ? Quartiles{kNan, kNan, kNan} : quartiles(values);
}

SweepSummary summarizeGroup(const std::vector<const SweepRecord*>& group) {
  const SweepRecord& first = *group.front();
  SweepSummary summary;
  summary.dataset = first.dataset;
  summary.method = first.method;
  summary.kind = first.kind;
  summary.magnitude = first.magnitude;
  summary.runs = group.size();
  std::vector<double> translation, rotation, good_translation, good_rotation, wall, cpu;
  for (const auto* record : group) {
    translation.push_back(record->translation_error);
    rotation.push_back(record->rotation_error);
    wall.push_back(record->milliseconds);
    cpu.push_back(record->cpu_milliseconds);
    if (!record->success()) continue;
    good_translation.push_back(record->translation_error);
    good_rotation.push_back(record->rotation_error);
  }
  summary.success_rate = static_cast<double>(good_translation.size()) / static_cast<double>(group.size());
  summary.translation = quartiles(translation);
  summary.rotation = quartiles(rotation);
  summary.translation_of_successes = quartilesOrNan(good_translation);
  summary.rotation_of_successes = quartilesOrNan(good_rotation);
  summary.milliseconds = quantile(wall, 0.5);
  summary.cpu_milliseconds = quantile(cpu, 0.5);
  return summary;
}

}  // namespace

std::vector<SweepSummary> summarize(const std::vector<SweepRecord>& records) {
  std::vector<std::string> datasets, methods;
  std::map<std::tuple<int, int, PerturbationKind, double>, std::vector<const SweepRecord*>> groups;
  for (const auto& record : records) {
    groups[{orderOf(record.dataset, datasets), orderOf(record.method, methods), record.kind,
            record.magnitude}]
        .push_back(&record);
  }
  std::vector<SweepSummary> summaries;
  for (const auto& group : groups) summaries.push_back(summarizeGroup(group.second));
  return summaries;
}

std::string toTable(const std::vector<SweepSummary>& summaries) {
  std::size_t dataset_width = 7, method_width = 6;
  for (const auto& s : summaries) {
    dataset_width = std::max(dataset_width, s.dataset.size());
    method_width = std::max(method_width, s.method.size());
  }
  std::vector<char> line(dataset_width + method_width + 160);
  const auto dataset = static_cast<int>(dataset_width), method = static_cast<int>(method_width);
  std::snprintf(line.data(), line.size(), "%-*s  %-*s  %10s  %5s  %9s  %20s  %20s  %8s  %8s\n", dataset,
                "dataset", method, "method", "magnitude", "runs", "success %", "mm: median (Q1-Q3)",
                "mrad: median (Q1-Q3)", "ms/scan", "cpu ms");
  std::string table = line.data();
  for (const auto& s : summaries) {
    char millimetres[64], milliradians[64];
    std::snprintf(millimetres, sizeof millimetres, "%.1f (%.1f-%.1f)", 1e3 * s.translation.median,
                  1e3 * s.translation.q1, 1e3 * s.translation.q3);
    std::snprintf(milliradians, sizeof milliradians, "%.1f (%.1f-%.1f)", 1e3 * s.rotation.median,
                  1e3 * s.rotation.q1, 1e3 * s.rotation.q3);
    std::snprintf(line.data(), line.size(), "%-*s  %-*s  %6.3g %-3s  %5zu  %9.1f  %20s  %20s  %8.2f  %8.2f\n",
                  dataset, s.dataset.c_str(), method, s.method.c_str(), s.magnitude,
                  s.kind == PerturbationKind::kTranslation ? "m" : "rad", s.runs, 100.0 * s.success_rate,
                  millimetres, milliradians, s.milliseconds, s.cpu_milliseconds);
    table += line.data();
  }
  return table;
}

}  // namespace ttsdf

// doc/parameters.md is written from the option tables: run this test with TTSDF_UPDATE_CONFIG=1.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <iomanip>
#include <sstream>

#include "ros/builder/map_builder_options.h"
#include "ros/demo/demo_ros.h"
#include "ros/demo/simulated_camera_options.h"
#include "ros/operator/map_surface.h"
#include "ros/operator/operator_menu.h"
#include "ros/parameters/localization_options.h"
#include "ttsdf_localization/evaluation/method.h"

namespace ttsdf {
namespace {

constexpr const char* kHead = R"(# Parameters

Written from the option tables of the code; do not edit. To write it anew: `TTSDF_UPDATE_CONFIG=1` in the environment of the
test `documentation_parameters_page_test`.

A node reads its parameters from its private namespace: `gates/max_jump_translation` of `localization_node` called
`localization` is `/localization/gates/max_jump_translation`. An unknown key, a wrong type or a value out of range is
refused with the key, the value and what was wanted, all at once, and nothing starts. Integers are accepted where a number
is wanted. The tools take the same options as flags (`--max-jump-translation`, with '-' for '_') and from
`--config FILE.yaml`; see [tools.md](tools.md).
)";

std::string cell(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return escaped;
}

std::string range(const ParameterSet::Entry& entry) {
  if (!entry.choices.empty()) {
    std::string all;
    for (const std::string& choice : entry.choices) all += (all.empty() ? "" : ", ") + choice;
    return all;
  }
  const OptionValue value = entry.get();
  if (std::holds_alternative<bool>(value)) return "true, false";
  if (std::holds_alternative<std::string>(value)) return "";
  std::ostringstream out;
  out << std::setprecision(10) << entry.min << " to " << entry.max;
  return out.str();
}

/// Which parameters may change while the node runs.
using IsLive = std::function<bool(const std::string& key)>;

void writeTable(std::ostream& out, const ParameterSet& parameters, const std::string& group,
                const IsLive& is_live) {
  out << "\n| key | default | range | unit | |\n|---|---|---|---|---|\n";
  for (const auto& entry : parameters.entries()) {
    if (entry.group != group) continue;
    const std::string value = toString(entry.get());
    out << "| `" << entry.key() << "` | " << (value.empty() ? "\"\"" : "`" + value + "`") << " | "
        << cell(range(entry)) << " | " << entry.unit << " | " << cell(entry.description)
        << (is_live && is_live(entry.key()) ? " (live)" : "") << " |\n";
  }
}

void writeSection(std::ostream& out, const std::string& title, const std::string& text,
                  const ParameterSet& parameters, const IsLive& is_live = {}) {
  out << "\n## " << title << "\n\n" << text << '\n';
  std::vector<std::string> groups;
  for (const auto& entry : parameters.entries()) {
    if (groups.empty() || groups.back() != entry.group) groups.push_back(entry.group);
  }
  for (const std::string& group : groups) {
    if (!group.empty()) out << "\n### " << title << ": " << group << '\n';
    writeTable(out, parameters, group, is_live);
  }
}

std::string page() {
  std::ostringstream out;
  out << kHead;
  LocalizationRosOptions localization;
  writeSection(
      out, "Localization",
      "`localization_node`, `ttsdf_localization/LocalizationNodelet`; "
      "[config/localization.yaml](../config/localization.yaml). The groups registration, search and "
      "global are also options of `ttsdf_register` and `ttsdf_evaluate`. Those marked (live) may change "
      "while the localizer runs: with rqt_reconfigure, or "
      "`/usr/lib/dynamic_reconfigure/dynparam set /localization gates/max_jump_translation 0.3`.",
      localizationParameters(localization), isLive);
  MapBuilderRosOptions builder;
  writeSection(out, "Map builder",
               "`map_builder_node`, `ttsdf_localization/MapBuilderNodelet`; "
               "[config/map_builder.yaml](../config/map_builder.yaml). The groups fusion and build are also "
               "options of `ttsdf_build`.",
               mapBuilderParameters(builder));
  SimulatedCameraOptions camera;
  camera.rig.camera.noise = depthNoise(camera.noise);
  writeSection(out, "Simulated camera",
               "`simulated_camera_node`; [config/simulated_camera.yaml](../config/simulated_camera.yaml). "
               "The noise options of the group camera have the defaults of the preset that `noise` names; "
               "these are kinect's.",
               simulatedCameraParameters(camera));
  OperatorMenuOptions menu;
  ParameterSet menu_parameters;
  menu_parameters.add("", menu, operatorMenuOptionTable());
  writeSection(out, "Operator menu", "`operator_menu_node`, started by the launch files with `rviz:=true`.",
               menu_parameters);
  MapSurfaceOptions surface;
  ParameterSet surface_parameters;
  surface_parameters.add("", surface, mapSurfaceOptionTable());
  writeSection(out, "Map surface", "`map_surface_node`, started by the launch files with `rviz:=true`.",
               surface_parameters);
  DemoOptions demo;
  ParameterSet demo_parameters;
  demo_parameters.add("", demo, demoOptionTable());
  writeSection(out, "Demo", "`demo_node`, started by `demo.launch`.", demo_parameters);
  CloudMethodOptions cloud;
  ParameterSet cloud_parameters;
  cloud_parameters.add("cloud", cloud, cloudMethodOptionTable());
  writeSection(out, "Baselines", "Point cloud methods of `ttsdf_evaluate`.", cloud_parameters);
  return out.str();
}

TEST(ParametersPage, SaysWhatTheTablesSay) {
  const std::string path = TTSDF_SOURCE_DIR "/doc/parameters.md";
  if (std::getenv("TTSDF_UPDATE_CONFIG")) std::ofstream(path) << page();
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), page()) << "run this test with TTSDF_UPDATE_CONFIG=1";
}

TEST(ParametersPage, EveryOptionHasASentenceAndARange) {
  LocalizationRosOptions localization;
  MapBuilderRosOptions builder;
  SimulatedCameraOptions camera;
  for (const ParameterSet& parameters : {localizationParameters(localization), mapBuilderParameters(builder),
                                         simulatedCameraParameters(camera)}) {
    for (const auto& entry : parameters.entries()) {
      EXPECT_GT(entry.description.size(), 5u) << entry.key();
      if (std::holds_alternative<double>(entry.get())) {
        EXPECT_LT(entry.min, entry.max) << entry.key();
      }
    }
  }
}

}  // namespace
}  // namespace ttsdf

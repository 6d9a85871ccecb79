// config/simulated_camera.yaml is the manual of the node: it must say every option, and its default.
#include "ttsdf_localization/ros/simulated_camera_options.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <set>

namespace ttsdf {
namespace {

/// Every row of the table is in the YAML node with its default value; `others` are keys of somebody else.
template <class Options>
void expectDefaults(const YAML::Node& node, const OptionTable<Options>& table, const Options& defaults,
                    std::set<std::string> others = {}) {
  for (const auto& row : table.rows()) {
    const YAML::Node value = node[row.name];
    ASSERT_TRUE(value) << row.name << " is missing";
    Options parsed = defaults;
    table.setFromText(parsed, row.name, value.as<std::string>());
    EXPECT_EQ(toString(row.get(parsed)), toString(row.get(defaults))) << row.name;
    others.insert(row.name);
  }
  for (const auto& entry : node)
    EXPECT_TRUE(others.count(entry.first.as<std::string>())) << entry.first << " is no option";
}

TEST(SimulatedCameraOptions, ConfigurationFileSaysTheDefaults) {
  const YAML::Node file = YAML::LoadFile(TTSDF_CONFIG_FOLDER "/simulated_camera.yaml");
  SimulatedCameraOptions defaults;
  defaults.rig.camera.noise = depthNoise(defaults.noise);
  expectDefaults(file, simulatedCameraOptionTable(), defaults,
                 {"mount", "camera", "path", "odometry", "clutter"});
  expectDefaults(file["mount"], cameraMountOptionTable(), defaults.rig.mount);
  expectDefaults(file["camera"], depthCameraOptionTable(), defaults.rig.camera);
  expectDefaults(file["path"], trajectoryOptionTable(), defaults.rig.path);
  expectDefaults(file["odometry"], odometryOptionTable(), defaults.rig.odometry);
  expectDefaults(file["clutter"], clutterOptionTable(), defaults.rig.clutter);
}

TEST(SimulatedCameraOptions, DefaultsAreInTheirRanges) {
  EXPECT_NO_THROW(simulatedCameraOptionTable().validate({}));
}

}  // namespace
}  // namespace ttsdf

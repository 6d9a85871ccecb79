// config/simulated_camera.yaml is the manual of the node: it names every option, its default and its meaning.
#include "ros/demo/simulated_camera_options.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace ttsdf {
namespace {

TEST(SimulatedCameraOptions, ConfigurationFileSaysWhatTheTablesSay) {
  const std::string path = TTSDF_CONFIG_FOLDER "/simulated_camera.yaml";
  if (std::getenv("TTSDF_UPDATE_CONFIG")) std::ofstream(path) << simulatedCameraYaml();
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), simulatedCameraYaml()) << "run this test with TTSDF_UPDATE_CONFIG=1";
}

TEST(SimulatedCameraOptions, ConfigurationFileIsReadAsTheDefaults) {
  const YAML::Node file = YAML::Load(simulatedCameraYaml());
  SimulatedCameraOptions defaults;
  defaults.rig.camera.noise = depthNoise(defaults.noise);
  const auto& table = depthCameraOptionTable();
  for (const auto& row : table.rows()) {
    ASSERT_TRUE(file["camera"][row.name]) << row.name;
    DepthCameraOptions read = defaults.rig.camera;
    table.setFromText(read, row.name, file["camera"][row.name].as<std::string>());
    EXPECT_EQ(row.get(read), row.get(defaults.rig.camera)) << row.name;
  }
}

TEST(SimulatedCameraOptions, DefaultsAreInTheirRanges) {
  EXPECT_NO_THROW(simulatedCameraOptionTable().validate({}));
}

}  // namespace
}  // namespace ttsdf

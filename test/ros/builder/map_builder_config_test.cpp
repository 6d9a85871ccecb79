// config/map_builder.yaml is the manual: it names every option, its default and its meaning.

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "ros/builder/map_builder_options.h"

namespace ttsdf {
namespace {

TEST(MapBuilderConfig, SaysWhatTheTablesSay) {
  const std::string path = TTSDF_CONFIG_DIR "/map_builder.yaml";
  if (std::getenv("TTSDF_UPDATE_CONFIG")) std::ofstream(path) << mapBuilderYaml();
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), mapBuilderYaml()) << "run this test with TTSDF_UPDATE_CONFIG=1";
}

TEST(MapBuilderConfig, IsReadAsTheDefaults) {
  const YAML::Node file = YAML::Load(mapBuilderYaml());
  MapBuilderRosOptions options;
  for (const auto& row : buildOptionTable().rows()) {
    ASSERT_TRUE(file["build"][row.name]) << row.name;
    buildOptionTable().setFromText(options.build, row.name, file["build"][row.name].as<std::string>());
    EXPECT_EQ(row.get(options.build), row.get(BuildOptions())) << row.name;
  }
  for (const auto& row : fusionOptionTable().rows()) {
    ASSERT_TRUE(file["fusion"][row.name]) << row.name;
    fusionOptionTable().setFromText(options.fusion, row.name, file["fusion"][row.name].as<std::string>());
    EXPECT_EQ(row.get(options.fusion), row.get(FusionOptions())) << row.name;
  }
}

}  // namespace
}  // namespace ttsdf

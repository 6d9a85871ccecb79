// config/map_builder.yaml is the manual: it must name every parameter, with the default that the code has.

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <set>
#include <string>

#include "ttsdf_localization/ros/map_builder_options.h"

namespace ttsdf {
namespace {

template <class Options>
void expectSame(const YAML::Node& node, const OptionTable<Options>& table, const std::string& group,
                const std::set<std::string>& groups = {}) {
  const Options defaults;
  for (const auto& row : table.rows()) {
    ASSERT_TRUE(node[row.name]) << group << row.name << " is missing in the file";
    Options read;
    table.setFromText(read, row.name, node[row.name].template as<std::string>());
    EXPECT_EQ(row.get(read), row.get(defaults)) << group << row.name;
  }
  for (const auto& entry : node) {
    const auto key = entry.first.as<std::string>();
    EXPECT_TRUE(table.has(key) || groups.count(key) > 0) << group << key << " is no parameter";
  }
}

TEST(MapBuilderConfig, FileAndCodeAgree) {
  const YAML::Node file = YAML::LoadFile(TTSDF_CONFIG_DIR "/map_builder.yaml");
  expectSame(file, mapBuilderRosOptionTable(), "", {"selection", "fusion", "build"});
  expectSame(file["selection"], scanSelectionOptionTable(), "selection/");
  expectSame(file["fusion"], fusionOptionTable(), "fusion/");
  expectSame(file["build"], buildOptionTable(), "build/");
}

}  // namespace
}  // namespace ttsdf

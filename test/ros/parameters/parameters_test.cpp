#include "ros/parameters/parameters.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "ros/parameters/localization_options.h"

namespace ttsdf {
namespace {

std::string refusal(XmlRpc::XmlRpcValue tree) {
  LocalizationRosOptions options;
  try {
    localizationParameters(options).load(tree, "/localization");
    checkAndTidy(options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// As rosparam reads it.
XmlRpc::XmlRpcValue scalar(const YAML::Node& node) {
  bool flag;
  int integer;
  double number;
  if (node.Tag() == "!") return XmlRpc::XmlRpcValue(node.as<std::string>());  // quoted
  if (YAML::convert<bool>::decode(node, flag)) return XmlRpc::XmlRpcValue(flag);
  if (YAML::convert<int>::decode(node, integer)) return XmlRpc::XmlRpcValue(integer);
  if (YAML::convert<double>::decode(node, number)) return XmlRpc::XmlRpcValue(number);
  return XmlRpc::XmlRpcValue(node.as<std::string>());
}

TEST(Parameters, FillTheGroups) {
  XmlRpc::XmlRpcValue tree;
  tree["odom_frame_id"] = "/odometry";
  tree["cloud"]["max_range"] = 4;  // an integer where a number is wanted
  tree["gates"]["min_inlier_ratio"] = 0.25;
  tree["registration"]["max_points"] = 1000;
  tree["tf_broadcast"] = false;
  LocalizationRosOptions options;
  localizationParameters(options).load(tree, "/localization");
  checkAndTidy(options);
  EXPECT_EQ(options.frames.odom_frame_id, "odometry");
  EXPECT_EQ(options.cloud.max_range, 4.0);
  EXPECT_EQ(options.localizer.gates.min_inlier_ratio, 0.25);
  EXPECT_EQ(options.localizer.registration.max_points, 1000);
  EXPECT_FALSE(options.frames.tf_broadcast);
}

TEST(Parameters, AnUnknownKeyIsRefusedWithTheOneMeant) {
  XmlRpc::XmlRpcValue tree;
  tree["gates"]["min_inlier_ration"] = 0.25;
  const std::string text = refusal(tree);
  EXPECT_TRUE(contains(text, "'gates/min_inlier_ration' is unknown")) << text;
  EXPECT_TRUE(contains(text, "did you mean 'gates/min_inlier_ratio'")) << text;
}

TEST(Parameters, AValueOutOfRangeNamesKeyValueAndRange) {
  XmlRpc::XmlRpcValue tree;
  tree["gates"]["min_inlier_ratio"] = 7.5;
  const std::string text = refusal(tree);
  EXPECT_TRUE(contains(text, "min_inlier_ratio")) << text;
  EXPECT_TRUE(contains(text, "7.5")) << text;
  EXPECT_TRUE(contains(text, "from 0 to 1")) << text;
}

TEST(Parameters, AllProblemsAreReportedAtOnce) {
  XmlRpc::XmlRpcValue tree;
  tree["tf_rate"] = "fast";
  tree["map_source"] = "internet";
  tree["cloud"][0] = 1.0;  // a list
  const std::string text = refusal(tree);
  EXPECT_TRUE(contains(text, "tf_rate")) << text;
  EXPECT_TRUE(contains(text, "file topic service")) << text;
  EXPECT_TRUE(contains(text, "cloud")) << text;
}

TEST(Parameters, ThoseOfOtherNodesAreLeftAlone) {
  XmlRpc::XmlRpcValue tree;
  tree["ekf"]["frequency"] = 30.0;  // a node below this one's name
  tree["num_worker_threads"] = 4;   // a nodelet manager's
  tree["bond_timeout"] = 10.0;
  EXPECT_EQ(refusal(tree), "accepted");
  XmlRpc::XmlRpcValue misspelt;
  misspelt["gate"]["min_inlier_ratio"] = 0.3;
  EXPECT_TRUE(contains(refusal(misspelt), "did you mean 'gates'"));
  XmlRpc::XmlRpcValue top;
  top["odom_frame"] = "wheels";
  EXPECT_TRUE(contains(refusal(top), "did you mean 'odom_frame_id'"));
}

TEST(Parameters, NumbersAreReadAsPeopleWriteThem) {
  XmlRpc::XmlRpcValue tree;
  tree["transform_tolerance"] = "1e-4";  // a text for YAML 1.1, and so for rosparam
  tree["cloud"]["max_points"] = 4000.0;
  LocalizationRosOptions options;
  localizationParameters(options).load(tree, "/localization");
  EXPECT_EQ(options.frames.transform_tolerance, 1e-4);
  EXPECT_EQ(options.cloud.max_points, 4000);
  tree["cloud"]["max_points"] = 4000.5;
  EXPECT_TRUE(contains(refusal(tree), "max_points"));
  tree["cloud"]["max_points"] = "many";
  EXPECT_TRUE(contains(refusal(tree), "max_points"));
}

TEST(Parameters, ContradictionsAreRefused) {
  XmlRpc::XmlRpcValue tree;
  tree["motion"]["prior"] = "external";
  EXPECT_TRUE(contains(refusal(tree), "tf_broadcast"));
  tree["tf_broadcast"] = false;
  EXPECT_EQ(refusal(tree), "accepted");
  XmlRpc::XmlRpcValue frames;
  frames["base_frame_id"] = "/map";
  EXPECT_TRUE(contains(refusal(frames), "three different frames"));
}

TEST(Parameters, WithoutOdometryThePriorIsTheVelocity) {
  for (const char* nothing : {"none", ""}) {
    XmlRpc::XmlRpcValue tree;
    tree["odom_frame_id"] = nothing;
    LocalizationRosOptions options;
    localizationParameters(options).load(tree, "/localization");
    checkAndTidy(options);
    EXPECT_EQ(options.frames.odom_frame_id, "");
    EXPECT_EQ(options.localizer.motion.prior, "constant_velocity");
  }
}

// The YAML file is the manual: it names every option, its default and its meaning.
TEST(LocalizationYaml, SaysWhatTheTablesSay) {
  const std::string path = TTSDF_CONFIG_DIR "/localization.yaml";
  if (std::getenv("TTSDF_UPDATE_CONFIG")) std::ofstream(path) << localizationYaml();
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), localizationYaml()) << "run this test with TTSDF_UPDATE_CONFIG=1";
}

TEST(LocalizationYaml, IsReadAsTheDefaults) {
  LocalizationRosOptions options;
  const ParameterSet parameters = localizationParameters(options);
  const YAML::Node yaml = YAML::Load(localizationYaml());
  XmlRpc::XmlRpcValue tree;
  for (const std::string& key : parameters.keys()) {
    const std::size_t slash = key.find('/');
    const YAML::Node node =
        slash == std::string::npos ? yaml[key] : yaml[key.substr(0, slash)][key.substr(slash + 1)];
    ASSERT_TRUE(node.IsScalar()) << key;
    XmlRpc::XmlRpcValue& value =
        slash == std::string::npos ? tree[key] : tree[key.substr(0, slash)][key.substr(slash + 1)];
    value = scalar(node);
  }
  ASSERT_NO_THROW(parameters.load(tree, "localization.yaml"));
  EXPECT_NO_THROW(checkAndTidy(options));
  const LocalizationRosOptions defaults;
  EXPECT_EQ(options.frames.odom_frame_id, defaults.frames.odom_frame_id);
  EXPECT_EQ(options.localizer.gates.max_rms_residual, defaults.localizer.gates.max_rms_residual);
}

}  // namespace
}  // namespace ttsdf

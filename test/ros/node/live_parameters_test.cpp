// What dynamic_reconfigure is told is what the option tables say.

#include "ros/node/live_parameters.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

namespace ttsdf {
namespace {

using dynamic_reconfigure::Config;

template <class Message, class Value>
void collect(const std::vector<Message>& messages, std::map<std::string, Value>& values) {
  for (const auto& message : messages) {
    EXPECT_TRUE(values.emplace(message.name, static_cast<Value>(message.value)).second)
        << message.name << " twice";
  }
}

/// Numbers and flags by name.
std::map<std::string, double> numbers(const Config& config) {
  std::map<std::string, double> values;
  collect(config.bools, values);
  collect(config.ints, values);
  collect(config.doubles, values);
  EXPECT_TRUE(config.strs.empty());
  return values;
}

double number(const OptionValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? 1.0 : 0.0;
  if (const auto* integer = std::get_if<int>(&value)) return *integer;
  return std::get<double>(value);
}

std::string refusal(const Config& config) {
  try {
    withLiveValues({}, config);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

Config single(const std::string& name, double value) {
  Config config;
  config.doubles.emplace_back();
  config.doubles.back().name = name;
  config.doubles.back().value = value;
  return config;
}

TEST(LiveParameters, AreDescribedByTheOptionTables) {
  const auto description = liveDescription();
  const auto minima = numbers(description.min), maxima = numbers(description.max),
             defaults = numbers(description.dflt);
  LocalizationRosOptions options;
  const ParameterSet set = localizationParameters(options);
  std::size_t live = 0;
  for (const auto& entry : set.entries()) {
    if (!isLive(entry.key())) continue;
    ++live;
    ASSERT_TRUE(defaults.count(entry.key())) << entry.key();
    EXPECT_EQ(defaults.at(entry.key()), number(entry.get())) << entry.key();
    if (std::holds_alternative<bool>(entry.get())) continue;
    EXPECT_EQ(minima.at(entry.key()), entry.min) << entry.key();
    EXPECT_EQ(maxima.at(entry.key()), entry.max) << entry.key();
  }
  EXPECT_EQ(defaults.size(), live);
  EXPECT_GT(live, 40U);
  std::size_t described = 0;
  std::set<int> ids;
  for (const auto& group : description.groups) {
    EXPECT_TRUE(ids.insert(group.id).second);
    described += group.parameters.size();
    for (const auto& parameter : group.parameters)
      EXPECT_FALSE(parameter.description.empty()) << parameter.name;
  }
  EXPECT_EQ(described, live);
}

TEST(LiveParameters, CoverGatesRatesAndBudgetButNoFrames) {
  for (const char* key : {"gates/max_rms_residual", "tf_rate", "cloud/max_points", "recovery/allow_global",
                          "search/starts", "global/starts", "motion/odometry_translation_noise"}) {
    EXPECT_TRUE(isLive(key)) << key;
  }
  for (const char* key : {"global_frame_id", "odom_frame_id", "map_file", "motion/prior",
                          "registration/max_points", "tf_broadcast", "gravity_source"}) {
    EXPECT_FALSE(isLive(key)) << key;
  }
}

TEST(LiveParameters, ChangeOnlyWhatIsNamed) {
  LocalizationRosOptions options;
  options.frames.odom_frame_id = "odometry";
  options.localizer.gates.min_inlier_ratio = 0.2;
  const LocalizationRosOptions changed = withLiveValues(options, single("gates/max_rms_residual", 0.05));
  EXPECT_EQ(changed.localizer.gates.max_rms_residual, 0.05);
  EXPECT_EQ(changed.localizer.gates.min_inlier_ratio, 0.2);
  EXPECT_EQ(changed.frames.odom_frame_id, "odometry");
  const auto values = numbers(liveConfig(changed));
  EXPECT_EQ(values.at("gates/max_rms_residual"), 0.05);
  // A whole configuration, as rqt_reconfigure sends it, changes nothing else either.
  EXPECT_EQ(numbers(liveConfig(withLiveValues(changed, liveConfig(changed)))), values);
}

TEST(LiveParameters, AreRefusedOutOfRangeUnknownOrNotLive) {
  EXPECT_NE(refusal(single("gates/max_rms_residual", 7.0)).find("max_rms_residual"), std::string::npos);
  EXPECT_NE(refusal(single("gates/nothing", 0.1)).find("unknown"), std::string::npos);
  EXPECT_NE(refusal(single("registration/kernel_scale_end", 0.1)).find("start again"), std::string::npos);
  EXPECT_NE(refusal(single("cloud/min_range", 50.0)).find("min_range"),
            std::string::npos);  // above max_range
  EXPECT_EQ(refusal(single("cloud/min_range", 0.3)), "accepted");
}

}  // namespace
}  // namespace ttsdf

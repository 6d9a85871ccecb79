#include "ttsdf_localization/options/option_table.h"

#include <gtest/gtest.h>

#include <limits>

namespace ttsdf {
namespace {

struct Inner {
  double scale = 0.5;
};

struct Sample {
  int count = 3;
  double sigma = 0.25;
  bool enabled = true;
  std::string method = "robust";
  std::string label = "anything";
  Inner inner;
};

OptionTable<Sample> sampleTable() {
  OptionTable<Inner> inner;
  inner.add("scale", &Inner::scale, 0.0, 1.0, "m", "scale of the inner part");
  OptionTable<Sample> table;
  table.add("count", &Sample::count, 1, 10, "", "how many")
      .add("sigma", &Sample::sigma, 0.0, 2.0, "m", "spread")
      .add("enabled", &Sample::enabled, "switch")
      .add("method", &Sample::method, {"robust", "plain"}, "which way")
      .add("label", &Sample::label, {}, "free text")
      .add(&Sample::inner, inner);
  return table;
}

/// The message of the std::invalid_argument that `action` throws; empty if it throws nothing.
template <class Action>
std::string refusal(const Action& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

void expectMentions(const std::string& message, const std::vector<std::string>& parts) {
  for (const auto& part : parts) {
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is missing in: " << message;
  }
}

TEST(OptionTable, ReadsAndWritesEveryMemberByName) {
  const auto table = sampleTable();
  Sample options;
  table.set(options, "count", 7);
  table.set(options, "sigma", 1.5);
  table.set(options, "enabled", false);
  table.set(options, "method", std::string("plain"));
  table.set(options, "label", std::string("kitchen"));
  table.set(options, "scale", 0.75);
  EXPECT_EQ(options.count, 7);
  EXPECT_EQ(options.sigma, 1.5);
  EXPECT_FALSE(options.enabled);
  EXPECT_EQ(options.method, "plain");
  EXPECT_EQ(options.label, "kitchen");
  EXPECT_EQ(options.inner.scale, 0.75);
  for (const auto& row : table.rows()) {
    if (row.name == "scale") {
      EXPECT_EQ(std::get<double>(row.get(options)), 0.75);
      EXPECT_EQ(row.unit, "m");
    }
  }
}

TEST(OptionTable, TakesAnIntegerWhereADoubleIsWantedButNotTheOtherWayRound) {
  const auto table = sampleTable();
  Sample options;
  table.set(options, "sigma", 1);
  EXPECT_EQ(options.sigma, 1.0);
  expectMentions(refusal([&] { table.set(options, "count", 2.0); }), {"count", "2", "integer"});
  expectMentions(refusal([&] { table.set(options, "enabled", 1); }), {"enabled", "true or false"});
  expectMentions(refusal([&] { table.set(options, "method", true); }), {"method", "text"});
}

TEST(OptionTable, NamesKeyValueAndRangeOfWhatItRefuses) {
  const auto table = sampleTable();
  Sample options;
  expectMentions(refusal([&] { table.set(options, "count", 11); }), {"count", "11", "1 to 10"});
  expectMentions(refusal([&] { table.set(options, "sigma", -0.5); }), {"sigma", "-0.5", "0 to 2", "m"});
  expectMentions(refusal([&] { table.set(options, "method", std::string("icp")); }),
                 {"method", "icp", "robust", "plain"});
  expectMentions(refusal([&] { table.set(options, "sgima", 1.0); }), {"sgima", "1", "unknown", "sigma"});
  EXPECT_EQ(options.count, 3) << "a refused value must leave the option alone";
  EXPECT_EQ(options.sigma, 0.25);
}

TEST(OptionTable, AcceptsTheEndsOfARangeAndRefusesNotANumber) {
  const auto table = sampleTable();
  Sample options;
  EXPECT_NO_THROW(table.set(options, "sigma", 0.0));
  EXPECT_NO_THROW(table.set(options, "sigma", 2.0));
  EXPECT_NO_THROW(table.set(options, "count", 1));
  EXPECT_NO_THROW(table.set(options, "count", 10));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 2.0 + 1e-12}) {
    EXPECT_THROW(table.set(options, "sigma", bad), std::invalid_argument) << bad;
  }
}

TEST(OptionTable, ParsesTextOfTheOptionsType) {
  const auto table = sampleTable();
  Sample options;
  table.setFromText(options, "count", "4");
  table.setFromText(options, "sigma", "1e-1");
  table.setFromText(options, "enabled", "false");
  table.setFromText(options, "label", "12");
  EXPECT_EQ(options.count, 4);
  EXPECT_EQ(options.sigma, 0.1);
  EXPECT_FALSE(options.enabled);
  EXPECT_EQ(options.label, "12");
  const std::vector<std::pair<std::string, std::string>> bad{
      {"count", "4.5"},  {"count", "four"}, {"count", ""},    {"count", "99999999999"},
      {"sigma", "0.1x"}, {"sigma", "nan"},  {"sigma", "inf"}, {"enabled", "on!"}};
  for (const auto& [name, text] : bad) {
    expectMentions(refusal([&, n = name, t = text] { table.setFromText(options, n, t); }), {name, text});
  }
  expectMentions(refusal([&] { table.setFromText(options, "nothing", "1"); }), {"nothing", "unknown"});
}

TEST(OptionTable, ValidatesAFilledStruct) {
  const auto table = sampleTable();
  Sample options;
  EXPECT_NO_THROW(table.validate(options));
  options.inner.scale = 3.0;
  expectMentions(refusal([&] { table.validate(options); }), {"scale", "3", "0 to 1"});
}

TEST(OptionTable, WritesValuesSoThatTheyCanBeReadBack) {
  const auto table = sampleTable();
  for (const double value : {0.1, 1.0 / 3.0, 1e-4, 0.123456789, 2.0, 1e-12}) {
    Sample options;
    table.setFromText(options, "sigma", toString(value));
    EXPECT_EQ(options.sigma, value) << toString(value);
  }
  EXPECT_EQ(toString(0.25), "0.25");
  EXPECT_EQ(toString(1e-4), "0.0001");
  EXPECT_EQ(toString(true), "true");
  EXPECT_EQ(toString(12), "12");
}

TEST(OptionTable, RefusesANameThatIsTaken) {
  auto table = sampleTable();
  expectMentions(refusal([&] { table.add("count", &Sample::sigma, 0.0, 1.0, "", "again"); }), {"count"});
}

}  // namespace
}  // namespace ttsdf

#include "ttsdf_localization/tools/command_line.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "ttsdf_localization/tools/printable.h"

namespace ttsdf {
namespace {

struct Motor {
  double top_speed = 1.5;
  int gears = 4;
  bool reverse = true;
  std::string fuel = "diesel";
  bool operator==(const Motor& o) const {
    return top_speed == o.top_speed && gears == o.gears && reverse == o.reverse && fuel == o.fuel;
  }
};

struct Radio {
  int gears = 7;  // shares its name with a row of Motor
  double volume = 0.5;
};

const OptionTable<Motor>& motorTable() {
  static const auto kTable = OptionTable<Motor>()
                                 .add("top_speed", &Motor::top_speed, 0.0, 10.0, "m/s", "How fast.")
                                 .add("gears", &Motor::gears, 1, 9, "", "How many.")
                                 .add("reverse", &Motor::reverse, "Goes backwards.")
                                 .add("fuel", &Motor::fuel, {"diesel", "power"}, "What it drinks.");
  return kTable;
}

const OptionTable<Radio>& radioTable() {
  static const auto kTable = OptionTable<Radio>()
                                 .add("gears", &Radio::gears, 1, 8, "", "Why not.")
                                 .add("volume", &Radio::volume, 0.0, 1.0, "", "How loud.");
  return kTable;
}

class CommandLineTest : public ::testing::Test {
 protected:
  CommandLineTest() : line_("car", "FILE [options]", "Drives a car.") {
    line_.positional("FILE", file_)
        .value("name", "TEXT", name_, "Its name.")
        .value("count", "N", count_, "Number of cars.")
        .value("factor", "X", factor_, "A factor.")
        .value("list", "WORD", list_, "Some words.")
        .flag("loud", loud_, "Makes noise.")
        .options("motor", motorTable(), motor_)
        .options("radio", radioTable(), radio_);
  }
  void TearDown() override {
    if (!config_path_.empty()) std::filesystem::remove(config_path_);
  }

  bool parse(std::vector<std::string> words) {
    std::vector<const char*> argv{"car"};
    for (const auto& word : words) argv.push_back(word.c_str());
    return line_.parse(static_cast<int>(argv.size()), argv.data(), out_);
  }
  std::string error(const std::vector<std::string>& words) {
    try {
      parse(words);
    } catch (const UsageError& e) {
      return e.what();
    }
    return "";
  }
  std::string config(const std::string& text) {
    config_path_ =
        (std::filesystem::temp_directory_path() / ("ttsdf_cli_" + std::to_string(::getpid()))).string();
    std::ofstream(config_path_) << text;
    return config_path_;
  }

  std::string file_, name_ = "beetle", config_path_;
  int count_ = 2;
  double factor_ = 0.5;
  std::vector<std::string> list_;
  bool loud_ = false;
  Motor motor_;
  Radio radio_;
  CommandLine line_;
  std::ostringstream out_;
};

TEST_F(CommandLineTest, KeepsDefaults) {
  ASSERT_TRUE(parse({"x.txt"}));
  EXPECT_EQ(file_, "x.txt");
  EXPECT_EQ(name_, "beetle");
  EXPECT_EQ(count_, 2);
  EXPECT_FALSE(loud_);
  EXPECT_TRUE(motor_ == Motor{});
  EXPECT_FALSE(line_.given("name"));
}

TEST_F(CommandLineTest, ReadsEveryKindOfFlag) {
  ASSERT_TRUE(
      parse({"--name", "kaefer", "x.txt", "--count=3", "--factor", "-2.5e-1", "--loud", "--list", "a",
             "--list", "b", "--top-speed", "2", "--reverse", "false", "--fuel", "power", "--volume", "1"}));
  EXPECT_EQ(name_, "kaefer");
  EXPECT_EQ(count_, 3);
  EXPECT_DOUBLE_EQ(factor_, -0.25);
  EXPECT_TRUE(loud_);
  EXPECT_EQ(list_, (std::vector<std::string>{"a", "b"}));
  EXPECT_DOUBLE_EQ(motor_.top_speed, 2.0);
  EXPECT_FALSE(motor_.reverse);
  EXPECT_EQ(motor_.fuel, "power");
  EXPECT_DOUBLE_EQ(radio_.volume, 1.0);
  EXPECT_TRUE(line_.given("name"));
  EXPECT_TRUE(line_.given("loud"));
}

TEST_F(CommandLineTest, NegativeListsAreValuesAndNoFlags) {
  ASSERT_TRUE(parse({"x", "--name", "-1,0,0"}));
  EXPECT_EQ(name_, "-1,0,0");
}

TEST_F(CommandLineTest, NameInTwoTablesSetsBoth) {
  ASSERT_TRUE(parse({"x", "--gears", "3"}));
  EXPECT_EQ(motor_.gears, 3);
  EXPECT_EQ(radio_.gears, 3);
}

TEST_F(CommandLineTest, RefusesWrongUsageAndSaysWhat) {
  EXPECT_NE(error({"x", "--speling"}).find("speling"), std::string::npos);
  EXPECT_NE(error({"x", "--nam", "y"}).find("nam"), std::string::npos);  // no guessing
  EXPECT_NE(error({"x", "--name"}).find("name"), std::string::npos);
  EXPECT_NE(error({"x", "--count", "two"}).find("count"), std::string::npos);
  EXPECT_NE(error({"x", "--count", "1", "--count", "2"}).find("count"), std::string::npos);
  EXPECT_NE(error({"x", "y"}).find("too many"), std::string::npos);
  EXPECT_NE(error({}).find("FILE"), std::string::npos);
}

TEST_F(CommandLineTest, RefusesOptionsOutOfRangeWithKeyValueAndRange) {
  const auto text = error({"x", "--top-speed", "11"});
  for (const char* part : {"top_speed", "11", "0 to 10", "m/s"})
    EXPECT_NE(text.find(part), std::string::npos) << text;
  EXPECT_NE(error({"x", "--fuel", "coal"}).find("diesel"), std::string::npos);
  EXPECT_NE(error({"x", "--gears", "2.5"}).find("integer"), std::string::npos);
}

TEST_F(CommandLineTest, HelpNamesFlagsDefaultsUnitsAndRanges) {
  EXPECT_FALSE(parse({"--help"}));
  const std::string help = out_.str();
  for (const char* part :
       {"usage: car FILE [options]", "Drives a car.", "--name", "(default beetle)", "--top-speed", "[m/s]",
        "default 1.5; 0 to 10", "diesel | power", "--config", "Options: radio"}) {
    EXPECT_NE(help.find(part), std::string::npos) << part << "\n" << help;
  }
}

TEST_F(CommandLineTest, OptionFileLiesBelowTheCommandLine) {
  const auto path = config("top_speed: 3\nfuel: power\nradio:\n  gears: 5\n");
  ASSERT_TRUE(parse({"x", "--config", path, "--top-speed", "4"}));
  EXPECT_DOUBLE_EQ(motor_.top_speed, 4.0);
  EXPECT_EQ(motor_.fuel, "power");
  EXPECT_EQ(radio_.gears, 5);
  EXPECT_EQ(motor_.gears, 4) << "a key below a section's name is meant for that section";
}

TEST_F(CommandLineTest, OptionFileErrorsNameFileAndKey) {
  for (const char* text :
       {"top_sped: 3\n", "motor:\n  volume: 1\n", "top_speed: 99\n", "top_speed: [1, 2]\n", "- 1\n"}) {
    const auto message = error({"x", "--config", config(text)});
    EXPECT_NE(message.find(config_path_), std::string::npos) << text << message;
  }
  EXPECT_THROW(parse({"x", "--config", config("a: [1\n")}), std::runtime_error);
  EXPECT_THROW(parse({"x", "--config", "/no/such/file.yaml"}), std::runtime_error);
}

TEST_F(CommandLineTest, OptionFilesThatAreNotWhatTheyLookLike) {
  const auto refusal = [this](const std::string& text) {
    try {
      parse({"x", "--config", config(text)});
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string("taken");
  };
  EXPECT_NE(refusal("top_speed: 3\nfuel: power\ntop_speed: 4\n")
                .find("line 3, column 1: got the key 'top_speed' again"),
            std::string::npos);
  EXPECT_NE(refusal("radio:\n  gears: 5\n  gears: 6\n").find("line 3, column 3: got the key 'gears' again"),
            std::string::npos);
  EXPECT_NE(refusal("top_speed: 3\n---\ntop_speed: 4\n").find("second document"), std::string::npos);
  EXPECT_NE(refusal(std::string("top_speed: 3\0\n", 14)).find("byte 0"), std::string::npos);
  EXPECT_NE(
      refusal("fuel: \"power\ntop_speed: 3\n").find("while scanning a quoted scalar that begins in line 1"),
      std::string::npos);
  EXPECT_EQ(refusal("# rock 'n roll\ngears: 5\nradio:\n  gears: 5\n"), "taken");
  EXPECT_EQ(refusal("--- # one document\nfuel: 'power'\n"), "taken");
}

TEST(RunTool, TurnsErrorsIntoExitCodes) {
  EXPECT_EQ(runTool("t", [] { return 0; }), 0);
  EXPECT_EQ(runTool("t", []() -> int { throw UsageError("x"); }), 2);
  EXPECT_EQ(runTool("t", []() -> int { throw std::runtime_error("x"); }), 1);
}

TEST(Printable, LeavesTextsAndTakesWhatATerminalObeys) {
  const std::string text = "Küche \"\u20ac\" \U0001F916 ~";
  EXPECT_EQ(printable(text), text);
  EXPECT_EQ(printable("a\tb\nc"), "a b c");
  EXPECT_EQ(printable("a\x1b[31mb\x07\x7f"), "a?[31mb??");
  EXPECT_EQ(printable("a\xc2\x9b"
                      "31m\xc2\x85\xc2\xa0."),
            "a?31m?\xc2\xa0.")
      << "C1 in UTF-8, and a space";
  EXPECT_EQ(printable("\x9b"
                      "31m\xff.\xc3"),
            "?31m?.?")
      << "bytes that are no UTF-8";
  EXPECT_EQ(printable("\xe2\xc2\x9b"
                      "1\xe0\x82\x9b"),
            "??1???")
      << "nor is what is cut off, or too long";
  EXPECT_EQ(printable("\xed\xa0\x80\xf4\x90\x80\x80"), "???????") << "surrogates, beyond the last character";
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a?b");
  EXPECT_EQ(printable("one\ntwo\r\nthree"), "one two? three") << "a text is one line";
}

TEST(RunTool, TextsOfFilesForgeNoLines) {
  const auto said = [](const std::string& text, bool usage) {
    testing::internal::CaptureStderr();
    runTool("t", [&]() -> int {
      if (usage) throw UsageError(text);
      throw std::runtime_error(text);
    });
    return testing::internal::GetCapturedStderr();
  };
  for (const bool usage : {false, true}) {
    const std::string error =
        said("frame 'x'\nt: error: the disk is broken\r\n\xe2\x80\xa8' is unknown", usage);
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
    EXPECT_EQ(error.find('\r'), std::string::npos);
    EXPECT_EQ(error.find("\xe2\x80\xa8"), std::string::npos) << "Unicode's own end of a line";
  }
}

TEST(ParseNumbers, ReadsListsAndRefusesOthers) {
  EXPECT_EQ(parseNumbers("f", "1,-2.5,3e-1", 3), (std::vector<double>{1.0, -2.5, 0.3}));
  EXPECT_EQ(parseNumberList("f", "4"), std::vector<double>{4.0});
  for (const char* text : {"", "1,2", "1,2,x", "1 2 3", "1,2,3,4"}) {
    EXPECT_THROW(parseNumbers("f", text, 3), UsageError) << text;
  }
}

}  // namespace
}  // namespace ttsdf

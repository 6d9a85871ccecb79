#pragma once
// An atlas of a simulated room, made once for the tests of a program.

#include <gtest/gtest.h>

#include "frames_fixture.h"
#include "tool_process.h"
#include "ttsdf_localization/atlas/atlas.h"

namespace ttsdf {

class AtlasTool : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    writeFrames(*folder_ / "frames", 24);
    first_ = build("atlas");
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static std::vector<std::string> arguments(const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> words{"build",
                                   *folder_ / name,
                                   "--frames",
                                   *folder_ / "frames",
                                   "--every",
                                   "2",
                                   "--voxel-size",
                                   "0.05",
                                   "--truncation",
                                   "0.15",
                                   "--max-depth",
                                   "5",
                                   "--max-rank",
                                   "20",
                                   "--refine-iterations",
                                   "4",
                                   "--size",
                                   "2.5",
                                   "--overlap",
                                   "0.8"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  static ToolRun build(const std::string& name, const std::vector<std::string>& more = {}) {
    return runProcess("ttsdf_atlas", arguments(name, more));
  }
  static ToolRun run(const std::vector<std::string>& arguments) {
    return runProcess("ttsdf_atlas", arguments);
  }
  /// A copy of the atlas to change.
  static std::string copy(const std::string& name) {
    std::filesystem::copy(*folder_ / "atlas", *folder_ / name);
    return *folder_ / name;
  }
  inline static TempFolder* folder_ = nullptr;
  inline static ToolRun first_;
};

}  // namespace ttsdf

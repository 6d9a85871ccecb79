// A folder whose atlas.yaml is written again is noticed, once for each change.

#include "ros/maps/folder_watch.h"

#include <gtest/gtest.h>

#include <future>
#include <stdexcept>

#include "../../support/temp_folder.h"
#include "ttsdf_localization/atlas/atlas.h"

namespace ttsdf::test {
namespace {

constexpr double kPeriod = 0.01;  // [s]

TEST(FolderWatch, CallsWhenAtlasYamlIsWrittenAgain) {
  const ttsdf::testing::TempFolder folder;
  folder.write(kAtlasFile, "one");
  std::promise<void> called;
  const FolderWatch watch(
      folder.path(), stateOfAtlas(folder.path()), kPeriod, [&] { called.set_value(); },
      [](const std::string& why) { ADD_FAILURE() << why; });
  folder.write(kAtlasFile, "another one");
  EXPECT_EQ(called.get_future().wait_for(std::chrono::seconds(30)), std::future_status::ready);
}

TEST(FolderWatch, SeesWhatWasWrittenBeforeItBegan) {
  const ttsdf::testing::TempFolder folder;
  folder.write(kAtlasFile, "one");
  const std::string seen = stateOfAtlas(folder.path());
  folder.write(kAtlasFile, "another one");
  std::promise<std::string> failed;
  const FolderWatch watch(
      folder.path(), seen, kPeriod, [] { throw std::runtime_error("half a file"); },
      [&](const std::string& why) { failed.set_value(why); });
  auto why = failed.get_future();
  ASSERT_EQ(why.wait_for(std::chrono::seconds(30)), std::future_status::ready);
  EXPECT_EQ(why.get(), "half a file");
}

}  // namespace
}  // namespace ttsdf::test

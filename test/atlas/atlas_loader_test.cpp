#include "ttsdf_localization/atlas/atlas_loader.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <thread>

#include "atlas_world.h"

namespace ttsdf::test {
namespace {

using ttsdf::testing::fileContent;
using ttsdf::testing::TempFolder;

constexpr double kPatience = 20.0;  // [s]
constexpr double kPitch = 4.0;      // between the rooms of a row [m]

std::string roomName(int n) { return "room" + std::to_string(n); }

/// A row of copies of one small room.
class Row : public ::testing::Test {
 protected:
  void makeRow(int count) {
    const TtSdfMap map =
        partOf(furnishedRoom, {-0.3, -0.3, -0.3}, {4.3, 3.3, 2.7}, Eigen::Isometry3d::Identity(), 0.1, 15);
    const auto bytes = serialize(map);
    for (int n = 0; n < count; ++n) {
      const std::string file = roomName(n) + ".ttsdf";
      writeFileAtomically(folder_.file(file), bytes, kMapFile);
      atlas_.maps.push_back(describeMap(roomName(n), file, bytes));
      atlas_.maps.back().T_atlas_map.translation().x() = kPitch * n;
    }
    options_.radius = 1.0;
    options_.map_megabytes = 0.5;
    options_.memory_megabytes = 2.0;
  }
  static Eigen::Vector3d inRoom(double n) { return {kPitch * n + 2.0, 1.5, 1.2}; }
  AtlasLoader loader() { return AtlasLoader(folder_.path(), atlas_, options_); }
  static std::vector<std::string> used(const AtlasLoader& loader) { return loader.status().in_use; }

  TempFolder folder_;
  Atlas atlas_;
  AtlasLoaderOptions options_;
};

TEST_F(Row, LoadsTheMapsAroundThePoseAndDropsOthers) {
  makeRow(30);
  AtlasLoader loader(folder_.path(), atlas_, options_);
  EXPECT_EQ(loader.field(), nullptr);
  std::size_t most = 0;
  for (int n = 0; n < 30; ++n) {
    loader.want(inRoom(n));
    ASSERT_TRUE(loader.waitUntilSettled(kPatience));
    const AtlasLoaderStatus status = loader.status();
    EXPECT_EQ(status.in_use, std::vector<std::string>{roomName(n)});
    EXPECT_TRUE(status.failed.empty() && status.waiting.empty());
    EXPECT_FALSE(status.behind);
    ASSERT_NE(loader.field(), nullptr);
    EXPECT_EQ(loader.field()->maps().front().name, roomName(n));
    most = std::max(most, status.bytes);
  }
  EXPECT_LE(most, std::size_t{2} << 20);
  EXPECT_GT(loader.status().loaded, 1u);  // what is no longer wanted stays as long as there is room
  EXPECT_LT(loader.status().loaded, 30u);
}

TEST_F(Row, MapsAtABorderAreUsedTogether) {
  makeRow(3);
  AtlasLoader loader(folder_.path(), atlas_, options_);
  loader.want(inRoom(0.5));
  ASSERT_TRUE(loader.waitUntilSettled(kPatience));
  EXPECT_EQ(loader.field()->maps().size(), 2u);
  // A little way back, out of the radius of the first: it stays in use, and no new field is made.
  const auto before = loader.field();
  loader.want(inRoom(0.5) + Eigen::Vector3d(1.4, 0.0, 0.0));
  ASSERT_TRUE(loader.waitUntilSettled(kPatience));
  EXPECT_EQ(loader.field(), before);
}

TEST_F(Row, TheWayAheadIsLoadedBeforeItIsReached) {
  makeRow(4);
  options_.prediction = 3.0;
  AtlasLoader loader(folder_.path(), atlas_, options_);
  loader.want(inRoom(0), {1.5, 0.0, 0.0});
  ASSERT_TRUE(loader.waitUntilSettled(kPatience));
  EXPECT_EQ(used(loader), (std::vector<std::string>{"room0", "room1"}));
  loader.want(inRoom(0), {NAN, 0.0, 0.0});
  ASSERT_TRUE(loader.waitUntilSettled(kPatience));
  EXPECT_EQ(used(loader), (std::vector<std::string>{"room0"}));
}

TEST_F(Row, TheNearestComeFirstWhenMemoryIsShort) {
  makeRow(9);
  options_.radius = 20.0;
  options_.memory_megabytes = 1.0;
  AtlasLoader loader(folder_.path(), atlas_, options_);
  loader.want(inRoom(4));
  ASSERT_TRUE(loader.waitUntilSettled(kPatience));
  const AtlasLoaderStatus status = loader.status();
  EXPECT_EQ(status.in_use.front(), "room4");
  EXPECT_GT(status.over_budget, 0u);
  EXPECT_EQ(status.over_budget + status.in_use.size(), 9u);
  EXPECT_LE(status.bytes, std::size_t{1} << 20);
}

TEST_F(Row, ADamagedMapIsReportedAndSkipped) {
  makeRow(3);
  std::string bytes = fileContent(folder_.file("room1.ttsdf"));
  const std::string whole = bytes;
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  folder_.write("room1.ttsdf", bytes);
  std::filesystem::remove(folder_.file("room2.ttsdf"));
  options_.radius = 10.0;
  options_.retry_seconds = 0.2;
  AtlasLoader loader(folder_.path(), atlas_, options_);
  loader.want(inRoom(1));
  ASSERT_TRUE(loader.waitUntilSettled(kPatience));
  AtlasLoaderStatus status = loader.status();
  EXPECT_EQ(status.in_use, std::vector<std::string>{"room0"});
  ASSERT_EQ(status.failed.size(), 2u);
  EXPECT_NE(status.failed.at("room1").find("room1.ttsdf"), std::string::npos) << status.failed.at("room1");
  EXPECT_NE(status.failed.at("room2").find("cannot open"), std::string::npos);
  // Made whole, it is picked up without being asked for again.
  folder_.write("room1.ttsdf", whole);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (used(loader).size() < 2 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(used(loader), (std::vector<std::string>{"room1", "room0"}));
}

TEST_F(Row, AMapLargerThanTheBudgetIsReported) {
  makeRow(1);
  options_.memory_megabytes = 0.05;
  options_.map_megabytes = 0.04;
  AtlasLoader loader(folder_.path(), atlas_, options_);
  loader.want(inRoom(0));
  ASSERT_TRUE(loader.waitUntilSettled(kPatience));
  EXPECT_EQ(loader.field(), nullptr);
  EXPECT_NE(loader.status().failed["room0"].find("memory_megabytes"), std::string::npos);
}

TEST_F(Row, ANewEditionReplacesTheOld) {
  makeRow(2);
  AtlasLoader loader(folder_.path(), atlas_, options_);
  loader.want(inRoom(0));
  ASSERT_TRUE(loader.waitUntilSettled(kPatience));
  const auto old = loader.field();
  const auto bytes = serialize(
      partOf(furnishedRoom, {-0.3, -0.3, -0.3}, {4.3, 3.3, 2.7}, Eigen::Isometry3d::Identity(), 0.1, 12));
  writeFileAtomically(folder_.file("room0.ttsdf"), bytes, kMapFile);
  atlas_.maps[0] = describeMap("room0", "room0.ttsdf", bytes);
  loader.setAtlas(atlas_);
  ASSERT_TRUE(loader.waitUntilSettled(kPatience));
  EXPECT_NE(loader.field()->maps().front().map_id, old->maps().front().map_id);
  EXPECT_EQ(loader.field()->maps().front().map_id, atlas_.maps[0].map_id);
  EXPECT_EQ(old->maps().size(), 1u);  // handed out before: as it was
  atlas_.maps[0].T_atlas_map.translation().x() += 0.5;
  loader.setAtlas(atlas_);
  ASSERT_TRUE(loader.waitUntilSettled(kPatience));
  EXPECT_EQ(loader.field()->maps().front().T_atlas_map.translation().x(), 0.5);
}

TEST_F(Row, TheCallerNeverWaitsAndTheEndCancels) {
  makeRow(40);
  options_.radius = 200.0;
  options_.memory_megabytes = 100.0;
  std::atomic<int> fields{0};
  const auto begin = std::chrono::steady_clock::now();
  double longest = 0.0;
  {
    AtlasLoader loader(folder_.path(), atlas_, options_, [&](const auto&) { ++fields; });
    for (int n = 0; n < 200; ++n) {
      const auto before = std::chrono::steady_clock::now();
      loader.want(inRoom(n % 40));
      loader.field();
      longest =
          std::max(longest, std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count());
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  }
  const double all = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  RecordProperty("longest_us", static_cast<int>(1e6 * longest));
  EXPECT_LT(longest, 0.05);  // generous: other programs may run
  EXPECT_LT(all, 5.0);
}

TEST_F(Row, FieldsAreAnnouncedOnce) {
  makeRow(2);
  std::mutex mutex;
  std::vector<std::size_t> sizes;
  {
    AtlasLoader loader(folder_.path(), atlas_, options_, [&](const std::shared_ptr<const AtlasField>& field) {
      const std::lock_guard<std::mutex> lock(mutex);
      sizes.push_back(field ? field->maps().size() : 0);
    });
    for (int n = 0; n < 3; ++n) {
      loader.want(inRoom(0.5));
      ASSERT_TRUE(loader.waitUntilSettled(kPatience));
    }
    loader.want(inRoom(100.0));
    ASSERT_TRUE(loader.waitUntilSettled(kPatience));
    EXPECT_EQ(loader.field(), nullptr);
  }
  EXPECT_EQ(sizes, (std::vector<std::size_t>{1, 2, 0}));
}

TEST_F(Row, RefusesOptionsThatMakeNoSense) {
  makeRow(1);
  options_.radius = 0.0;
  EXPECT_THROW(loader(), std::invalid_argument);
  options_.radius = 1.0;
  atlas_.maps[0].name = "..";
  EXPECT_THROW(loader(), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf::test

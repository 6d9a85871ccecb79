// A scan without a prior, in a folder of maps.

#include "ttsdf_localization/atlas/atlas_locator.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "atlas_world.h"
#include "ttsdf_localization/atlas/place_index_file.h"

namespace ttsdf::test {
namespace {

using ttsdf::testing::TempFolder;

const Eigen::Vector3d kDown(0.0, 1.0, 0.0);  // of the level camera below

/// Two rooms in two maps that share a metre, the second one turned in a frame of its own, and a bare third
/// room far away.
class Building : public ::testing::Test {
 protected:
  void SetUp() override {
    const Eigen::Isometry3d T_right = turnedBy(0.7, {3.0, 1.0, 0.2}),
                            T_bare = turnedBy(0.0, {30.0, 0.0, 0.0});
    const auto left = partOf(twoRooms, {-0.3, -0.3, -0.3}, {4.5, 3.3, 2.7}, Eigen::Isometry3d::Identity());
    const auto right = partOf(twoRooms, {3.5, -0.3, -0.3}, {8.3, 3.3, 2.7}, T_right);
    const auto bare = partOf(bareRoom, {29.7, -0.3, -0.3}, {35.3, 5.3, 2.7}, T_bare);
    atlas_.maps = {store(left, "left", Eigen::Isometry3d::Identity(), folder_.path()),
                   store(right, "right", T_right, folder_.path()),
                   store(bare, "bare", T_bare, folder_.path())};
    writeAtlas(atlas_, folder_.path());
  }
  static double bareRoom(const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = p - Eigen::Vector3d(30.0, 0.0, 0.0);
    return std::min({q.minCoeff(), (Eigen::Vector3d(5.0, 5.0, 2.4) - q).minCoeff(),
                     boxSdf(q, {4.0, 1.0, 0.5}, {0.5, 0.5, 0.5})});
  }
  /// A wide level camera. At x = 3.2 looking along x it sees into both maps.
  static Eigen::Isometry3d camera(double x, double y, double yaw) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() << x, y, 1.3;
    Eigen::Matrix3d level;
    level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    T.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix() * level;
    return T;
  }
  static ScanPoints seen(const Sdf& world, const Eigen::Isometry3d& T) {
    return castRays(world, T, wideDirections(), 0.005);
  }
  static AtlasLocatorOptions options() {
    AtlasLocatorOptions o;
    o.search.global.starts = 800;
    return o;
  }
  TempFolder folder_;
  Atlas atlas_;
};

TEST_F(Building, AScanOverABorderIsFound) {
  AtlasLocator locator(folder_.path(), atlas_, options());
  const Eigen::Isometry3d truth = camera(3.2, 2.0, 0.3);
  const AtlasLocation found = locator.locate(seen(twoRooms, truth), kDown);
  ASSERT_TRUE(found.success) << name(found.reason);
  const PoseError error = poseError(truth, found.candidates[0].T_atlas_sensor);
  EXPECT_LT(error.translation, 0.03);
  EXPECT_LT(error.rotation, 0.02);
  EXPECT_EQ(found.candidates[0].map, "left");
  EXPECT_TRUE(locator.failed().empty());
}

TEST_F(Building, TheIndexIsReadWhereThereIsOne) {
  AtlasLocator first(folder_.path(), atlas_, options());
  EXPECT_TRUE(first.index().maps().empty());
  EXPECT_FALSE(first.completeIndex([](double) { return false; }));
  ASSERT_TRUE(first.completeIndex());
  EXPECT_EQ(first.index().maps().size(), 3u);
  writePlaceIndex(first.index(), folder_.path());
  const AtlasLocator second(folder_.path(), atlas_, options());
  EXPECT_EQ(serialize(second.index()), serialize(first.index()));
}

TEST_F(Building, ADamagedIndexIsReportedAndMadeAgain) {
  folder_.write(kPlaceIndexFile, "TTSDFPL3 and then rubbish");
  AtlasLocator locator(folder_.path(), atlas_, options());
  ASSERT_EQ(locator.failed().count(""), 1u);
  EXPECT_NE(locator.failed().at("").find(kPlaceIndexFile), std::string::npos);
  EXPECT_TRUE(locator.completeIndex());
  EXPECT_EQ(locator.index().maps().size(), 3u);
}

// The scan may have been taken in the map that nobody can read.
TEST_F(Building, NothingIsAcceptedWhileAMapCannotBeRead) {
  std::filesystem::remove(folder_.file("bare.ttsdf"));
  AtlasLocator locator(folder_.path(), atlas_, options());
  const AtlasLocation found = locator.locate(seen(twoRooms, camera(3.2, 2.0, 0.3)), kDown);
  EXPECT_FALSE(found.success);
  EXPECT_EQ(found.reason, TerminationReason::kUnsure);
  ASSERT_EQ(locator.failed().count("bare"), 1u);
  EXPECT_EQ(locator.index().maps().size(), 2u);
}

TEST_F(Building, TwinsAreNamedAndNotDecided) {
  AtlasMap twin = atlas_.maps[2];
  twin.name = "twin";
  twin.file = "twin.ttsdf";
  twin.T_atlas_map.translation().x() += 50.0;
  std::filesystem::copy_file(folder_.file("bare.ttsdf"), folder_.file("twin.ttsdf"));
  atlas_.maps.push_back(twin);
  AtlasLocator locator(folder_.path(), atlas_, options());
  const AtlasLocation found = locator.locate(seen(bareRoom, camera(31.5, 3.5, -0.5)), kDown);
  EXPECT_FALSE(found.success);
  EXPECT_EQ(found.reason, TerminationReason::kAmbiguous);
  std::set<std::string> names;
  for (std::size_t n = 0; n < 2 && n < found.candidates.size(); ++n) names.insert(found.candidates[n].map);
  EXPECT_EQ(names, (std::set<std::string>{"bare", "twin"}));
}

TEST_F(Building, OptionsAreChecked) {
  AtlasLocatorOptions bad;
  bad.map_megabytes = 0.0;
  EXPECT_THROW(AtlasLocator(folder_.path(), atlas_, bad), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf::test

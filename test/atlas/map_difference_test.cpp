#include "ttsdf_localization/atlas/map_difference.h"

#include <gtest/gtest.h>

#include <cmath>

namespace ttsdf {
namespace {

/// Boxes of 4 x 4 x 3 m along x, every 5 m.
Atlas row(int count) {
  Atlas atlas;
  for (int n = 0; n < count; ++n) {
    AtlasMap map;
    map.name = "m" + std::to_string(n);
    map.file = map.name + ".ttsdf";
    map.map_id = "0000000" + std::to_string(n);
    map.voxel_size = 0.05;
    map.size = Eigen::Vector3d(4.0, 4.0, 3.0);
    map.T_atlas_map.translation().x() = 5.0 * n;
    atlas.maps.push_back(map);
  }
  return atlas;
}

const Eigen::Vector3d kInSecond(6.0, 2.0, 1.0);  // 2 m from the first box, 4 m from the third

TEST(MapDifference, NamesWhatIsNearAndNotHeldTheNearestFirst) {
  EXPECT_EQ(mapDifference(row(5), kInSecond, 0.0, {}).missing, (std::vector<std::size_t>{1}));
  EXPECT_EQ(mapDifference(row(5), kInSecond, 2.1, {}).missing, (std::vector<std::size_t>{1, 0}));
  EXPECT_EQ(mapDifference(row(5), kInSecond, 4.1, {"00000001"}).missing, (std::vector<std::size_t>{0, 2}));
}

TEST(MapDifference, DropsWhatIsFarReplacedOrGone) {
  const auto difference = mapDifference(row(5), kInSecond, 2.1, {"00000004", "00000001", "deadbeef"});
  EXPECT_EQ(difference.dropped, (std::vector<std::string>{"00000004", "deadbeef"}));
  EXPECT_EQ(difference.missing, (std::vector<std::size_t>{0}));
}

TEST(MapDifference, HoldingAllThatIsNearNothingIsSent) {
  const auto difference = mapDifference(row(3), kInSecond, 50.0, {"00000000", "00000001", "00000002"});
  EXPECT_TRUE(difference.missing.empty());
  EXPECT_TRUE(difference.dropped.empty());
}

TEST(MapDifference, RefusesWhatIsNoSphere) {
  EXPECT_THROW(mapDifference(row(1), {NAN, 0.0, 0.0}, 1.0, {}), std::invalid_argument);
  EXPECT_THROW(mapDifference(row(1), kInSecond, -1.0, {}), std::invalid_argument);
  EXPECT_THROW(mapDifference(row(1), kInSecond, INFINITY, {}), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf

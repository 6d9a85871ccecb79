// A walk through two rooms with the localizer, while maps come and go.

#include <gtest/gtest.h>

#include "atlas_world.h"
#include "ttsdf_localization/atlas/atlas_loader.h"
#include "ttsdf_localization/localization/localizer.h"

namespace ttsdf::test {
namespace {

using ttsdf::testing::TempFolder;

struct Drive {
  int exchanges = 0, tracking = 0;
  std::size_t over_budget = 0;  ///< at the most
};
constexpr int kScans = 70;

/// A walk with memory for a share of the maps, during which one of them is replaced; whatever pose there is
/// must be right.
void drive(double share, Drive& result) {
  const TempFolder folder;
  Atlas atlas, next;
  // Three maps of 3.4 m that overlap by a metre, the middle one in a turned frame.
  for (int n = 0; n < 3; ++n) {
    const double low = -0.3 + 2.6 * n;
    const auto T = n == 1 ? turnedBy(0.7, {3.0, 1.0, 0.2}) : turnedBy(0.0, {0.0, 0.0, 0.0});
    const auto map = partOf(twoRooms, {low, -0.3, -0.3}, {low + 3.4, 3.3, 2.7}, T, 0.05, 30);
    atlas.maps.push_back(store(map, "part" + std::to_string(n), T, folder.path()));
  }
  const auto T_next = atlas.maps[1].T_atlas_map;
  const auto next_map = partOf(twoRooms, {2.3, -0.3, -0.3}, {5.7, 3.3, 2.7}, T_next, 0.05, 35);
  AtlasLoaderOptions options;
  options.radius = 3.5;  // as far as most of what the camera sees
  options.map_megabytes = 1.5;
  {
    AtlasLoader all(folder.path(), atlas, options);
    all.want({4.0, 1.5, 1.3});
    ASSERT_TRUE(all.waitUntilSettled(20.0));
    ASSERT_EQ(all.status().in_use.size(), 3u);
    options.memory_megabytes = share * static_cast<double>(all.status().bytes) / 1048576.0;
  }
  options.map_megabytes = std::min(options.map_megabytes, options.memory_megabytes);
  AtlasLoader loader(folder.path(), atlas, options);

  const auto poseAt = [](int n) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() << 1.4 + 0.05 * n, 1.6 + 0.1 * std::sin(0.1 * n), 1.3;
    Eigen::Matrix3d level;
    level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    T.linear() =
        Eigen::AngleAxisd(0.6 * std::sin(0.08 * n), Eigen::Vector3d::UnitZ()).toRotationMatrix() * level;
    return T;
  };
  LocalizerOptions localizer_options;
  localizer_options.recovery.allow_global = false;
  Localizer localizer(localizer_options);
  PoseGuess guess;
  guess.T_map_base = poseAt(0);
  guess.covariance = 1e-3 * Matrix6d::Identity();
  localizer.setGuess(guess);
  std::shared_ptr<const AtlasField> field;
  for (int n = 0; n < kScans; ++n) {
    if (n == kScans / 2) {  // as a server or another edition of the folder would say it
      next = atlas;
      next.maps[1] = store(next_map, "part1", T_next, folder.path());
      next.maps[1].version = 2;
      ASSERT_NE(next.maps[1].map_id, atlas.maps[1].map_id);
      loader.setAtlas(next);
    }
    loader.want(poseAt(n).translation(), {0.5, 0.0, 0.0});
    ASSERT_TRUE(
        loader.waitUntilSettled(20.0));  // the test asks for the same maps at the same scans every time
    EXPECT_LE(loader.status().bytes, static_cast<std::size_t>(options.memory_megabytes * 1048576.0));
    result.over_budget = std::max(result.over_budget, loader.status().over_budget);
    if (loader.field() != field) {
      field = loader.field();
      const LocalizerState before = localizer.state();
      localizer.exchangeMap(Localizer::prepareWith(field, field->farField(), localizer_options.registration));
      if (result.exchanges++ > 0) {
        EXPECT_EQ(localizer.state(), before);
      }
    }
    LocalizerScan scan;
    scan.stamp = 100.0 + 0.1 * n;
    scan.points = castRays(twoRooms, poseAt(n), cameraDirections(60, 45), 0.003, static_cast<unsigned>(n));
    const LocalizationUpdate update = localizer.process(scan);
    if (update.pose_valid) {
      EXPECT_LT(poseError(update.T_map_sensor, poseAt(n)).translation, 0.01) << n;
    }
    if (localizer.state() != LocalizerState::kTracking) continue;
    ++result.tracking;
    ASSERT_TRUE(update.pose_valid) << n;
  }
}

TEST(AtlasDrive, TrackingGoesOnWhileMapsAreExchanged) {
  Drive result;
  drive(2.0, result);
  EXPECT_EQ(result.over_budget, 0u);
  EXPECT_EQ(result.exchanges, 2);
  EXPECT_GE(result.tracking, kScans - 5);
}

// Where a scan reaches into a map for which there is no memory it is not verified.
TEST(AtlasDrive, WithoutMemoryForAllMapsNothingIsWrong) {
  Drive result;
  drive(0.75, result);
  RecordProperty("tracking_of_70", result.tracking);
  EXPECT_GE(result.over_budget, 1u);
}

}  // namespace
}  // namespace ttsdf::test

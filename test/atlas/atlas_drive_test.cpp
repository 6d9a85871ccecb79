// A walk through two rooms with the localizer, while maps come and go.

#include <gtest/gtest.h>

#include "atlas_world.h"
#include "ttsdf_localization/atlas/atlas_loader.h"
#include "ttsdf_localization/localization/localizer.h"

namespace ttsdf::test {
namespace {

using ttsdf::testing::TempFolder;

TEST(AtlasDrive, TrackingGoesOnWhileMapsAreExchanged) {
  const TempFolder folder;
  Atlas atlas;
  // Three maps of 3.4 m that overlap by a metre, the middle one in a turned frame.
  for (int n = 0; n < 3; ++n) {
    const double low = -0.3 + 2.6 * n;
    const auto T = n == 1 ? turnedBy(0.7, {3.0, 1.0, 0.2}) : turnedBy(0.0, {0.0, 0.0, 0.0});
    const auto map = partOf(twoRooms, {low, -0.3, -0.3}, {low + 3.4, 3.3, 2.7}, T, 0.05, 30);
    atlas.maps.push_back(store(map, "part" + std::to_string(n), T, folder.path()));
  }
  AtlasLoaderOptions options;
  options.radius = 1.0;
  options.map_megabytes = 1.5;
  options.memory_megabytes = 4.0;  // not all three
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
  int exchanges = 0, tracking = 0;
  constexpr int kScans = 70;
  for (int n = 0; n < kScans; ++n) {
    loader.want(poseAt(n).translation(), {0.5, 0.0, 0.0});
    ASSERT_TRUE(
        loader.waitUntilSettled(20.0));  // the test asks for the same maps at the same scans every time
    EXPECT_LE(loader.status().bytes, std::size_t{4} << 20);
    if (loader.field() != field) {
      field = loader.field();
      const LocalizerState before = localizer.state();
      localizer.exchangeMap(Localizer::prepareWith(field, field->farField(), localizer_options.registration));
      if (exchanges++ > 0) {
        EXPECT_EQ(localizer.state(), before);
      }
    }
    LocalizerScan scan;
    scan.stamp = 100.0 + 0.1 * n;
    scan.points = castRays(twoRooms, poseAt(n), cameraDirections(60, 45), 0.003, static_cast<unsigned>(n));
    const LocalizationUpdate update = localizer.process(scan);
    if (localizer.state() != LocalizerState::kTracking) continue;
    ++tracking;
    ASSERT_TRUE(update.pose_valid) << n;
    EXPECT_LT(poseError(update.T_map_sensor, poseAt(n)).translation, 0.01) << n;
  }
  EXPECT_GT(exchanges, 2);
  EXPECT_GE(tracking, kScans - 5);
}

}  // namespace
}  // namespace ttsdf::test

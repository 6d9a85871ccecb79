// A scan that reaches into a map which is not in memory is not verified by what is.

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "atlas_world.h"
#include "ttsdf_localization/atlas/atlas_loader.h"
#include "ttsdf_localization/field/long_range_field.h"
#include "ttsdf_localization/registration/registration.h"

namespace ttsdf::test {
namespace {

using ttsdf::testing::TempFolder;

const Eigen::Vector3d kLow(-0.3, -0.3, -0.3), kMiddleHigh(4.2, 3.3, 2.7), kMiddleLow(3.6, -0.3, -0.3),
    kHigh(8.3, 3.3, 2.7);

PlacedField placed(const std::string& name, const TtSdfMap& map) {
  PlacedField result;
  result.name = name;
  result.field = makeField(map);
  result.far = makeLongRangeField(*result.field);
  return result;
}

class TwoMaps : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Eigen::Isometry3d here = Eigen::Isometry3d::Identity();
    first = partOf(twoRooms, kLow, kMiddleHigh, here);
    second = partOf(twoRooms, kMiddleLow, kHigh, here);
  }
  /// A level camera in the first room that looks along a heading.
  static Eigen::Isometry3d camera(double x, double y, double heading) {
    Eigen::Matrix3d level;
    level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    Eigen::Isometry3d T = turnedBy(heading, {x, y, 1.3});
    T.linear() = T.linear() * level;
    return T;
  }
  static ScanPoints scanFrom(const Eigen::Isometry3d& T) {
    return castRays(twoRooms, T, cameraDirections(60, 45), 0.003);
  }
  static RegistrationResult align(const AtlasField& field, const Eigen::Isometry3d& T) {
    Registration registration(std::shared_ptr<const DistanceField>(&field, [](const DistanceField*) {}),
                              RegistrationOptions(), field.farField());
    Eigen::Isometry3d prior = T;
    prior.translation() += Eigen::Vector3d(0.02, -0.02, 0.01);
    return registration.align(scanFrom(T), prior);
  }
  static OrientedBox boxOf(const TtSdfMap& map) { return describeMap("m", "m.ttsdf", serialize(map)).box(); }
  static TtSdfMap first, second;
};
TtSdfMap TwoMaps::first, TwoMaps::second;

TEST_F(TwoMaps, PointsInAnAbsentMapAreFarFromEverySurface) {
  const AtlasField field({placed("first", first)}, {boxOf(second)});
  Eigen::Matrix3Xf points(3, 4);
  points << 2.0F, 6.0F, 4.1F, 20.0F, 1.5F, 1.5F, 1.5F, 1.5F, 1.0F, 1.0F, 1.0F, 1.0F;
  points.colwise() -= field.geometry().origin.cast<float>();
  const FieldSamples samples = field.evaluate(points);
  EXPECT_EQ(samples.states[0], PointState::kValid);  // of the map at hand
  EXPECT_LT(samples.values[0], AtlasField::kAbsentDistance);
  EXPECT_EQ(samples.states[1], PointState::kValid);
  EXPECT_EQ(samples.values[1], AtlasField::kAbsentDistance);
  EXPECT_TRUE(samples.gradients.col(1).isZero());
  EXPECT_GT(samples.gradients.col(2).norm(), 0.5F);  // both boxes hold it: the map at hand answers
  EXPECT_EQ(samples.states[3], PointState::kOutside);
}

TEST_F(TwoMaps, AScanThatReachesIntoAnAbsentMapIsNotVerified) {
  const AtlasField alone({placed("first", first)}, {boxOf(second)});
  const AtlasField both({placed("first", first), placed("second", second)});
  int reaching = 0;
  for (const double y : {1.2, 1.6, 2.2}) {
    for (const double heading : {-0.3, 0.0, 0.3}) {
      const Eigen::Isometry3d T = camera(2.4, y, heading);
      const ScanPoints scan = scanFrom(T);
      const Eigen::Matrix3Xf seen =
          (T.linear().cast<float>() * scan).colwise() + T.translation().cast<float>();
      const auto beyond = (seen.row(0).array() > static_cast<float>(kMiddleHigh.x())).count();
      if (3 * beyond < scan.cols()) continue;
      ++reaching;
      EXPECT_TRUE(align(both, T).success) << y << ' ' << heading;
      EXPECT_FALSE(align(alone, T).success) << y << ' ' << heading;
    }
  }
  EXPECT_GE(reaching, 5);
}

TEST_F(TwoMaps, AScanThatDoesNotIsVerifiedAsBefore) {
  const AtlasField alone({placed("first", first)}, {boxOf(second)}), before({placed("first", first)});
  const Eigen::Isometry3d T = camera(2.6, 1.6, 3.0);
  const RegistrationResult result = align(alone, T);
  EXPECT_TRUE(result.success);
  EXPECT_TRUE(result.T_map_sensor.isApprox(align(before, T).T_map_sensor, 1e-9));
}

TEST_F(TwoMaps, TheLoaderKnowsWhatItHasNoMemoryFor) {
  const TempFolder folder;
  Atlas atlas;
  atlas.maps.push_back(store(first, "first", Eigen::Isometry3d::Identity(), folder.path()));
  atlas.maps.push_back(store(second, "second", Eigen::Isometry3d::Identity(), folder.path()));
  AtlasLoaderOptions options;
  {
    AtlasLoader both(folder.path(), atlas, options);
    both.want({1.5, 1.5, 1.2});
    ASSERT_TRUE(both.waitUntilSettled(20.0));
    ASSERT_EQ(both.status().in_use.size(), 2u);
    EXPECT_TRUE(align(*both.field(), camera(2.4, 1.6, 0.0)).success);
    options.memory_megabytes = 0.75 * static_cast<double>(both.status().bytes) / 1048576.0;
  }
  options.map_megabytes = options.memory_megabytes;
  AtlasLoader loader(folder.path(), atlas, options);
  loader.want({1.5, 1.5, 1.2});
  ASSERT_TRUE(loader.waitUntilSettled(20.0));
  ASSERT_EQ(loader.status().in_use, std::vector<std::string>{"first"});
  ASSERT_EQ(loader.status().over_budget, 1u);
  EXPECT_FALSE(align(*loader.field(), camera(2.4, 1.6, 0.0)).success);
  EXPECT_TRUE(align(*loader.field(), camera(2.6, 1.6, 3.0)).success);
}

// It will not come: the robot is tracked around it as at the border of what is mapped.
TEST_F(TwoMaps, ADamagedMapIsNotAbsent) {
  const TempFolder folder;
  Atlas atlas;
  atlas.maps.push_back(store(first, "first", Eigen::Isometry3d::Identity(), folder.path()));
  atlas.maps.push_back(store(second, "second", Eigen::Isometry3d::Identity(), folder.path()));
  const std::string file = folder.path() + "/" + atlas.maps[1].file;
  const auto stateIn = [](const AtlasField& field) {
    const Eigen::Vector3f p = (Eigen::Vector3d(6.0, 1.5, 1.0) - field.geometry().origin).cast<float>();
    return field.evaluate(Eigen::Matrix3Xf(p)).states[0];
  };
  AtlasLoaderOptions options;
  options.retry_seconds = 0.2;
  {
    options.radius = 0.1;  // the second is not wanted: absent
    AtlasLoader loader(folder.path(), atlas, options);
    loader.want({1.5, 1.5, 1.2});
    ASSERT_TRUE(loader.waitUntilSettled(20.0));
    ASSERT_EQ(loader.status().in_use.size(), 1u);
    EXPECT_EQ(stateIn(*loader.field()), PointState::kValid);
  }
  options.radius = 6.0;
  std::filesystem::resize_file(file, 100);
  AtlasLoader loader(folder.path(), atlas, options);
  loader.want({1.5, 1.5, 1.2});
  ASSERT_TRUE(loader.waitUntilSettled(20.0));
  ASSERT_EQ(loader.status().in_use, std::vector<std::string>{"first"});
  EXPECT_EQ(stateIn(*loader.field()), PointState::kOutside);
  const auto field = loader.field();
  std::this_thread::sleep_for(std::chrono::milliseconds(600));  // it is tried again and again
  EXPECT_EQ(loader.field(), field);
  store(second, "second", Eigen::Isometry3d::Identity(), folder.path());
  for (int n = 0; n < 500 && loader.status().in_use.size() < 2; ++n)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(stateIn(*loader.field()), PointState::kValid);
}

}  // namespace
}  // namespace ttsdf::test

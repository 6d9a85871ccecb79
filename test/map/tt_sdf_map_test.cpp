#include "ttsdf_localization/map/tt_sdf_map.h"

#include <gtest/gtest.h>

#include "room_map.h"

namespace ttsdf {
namespace {

TEST(TtSdfMap, ASoundMapPassesTheCheck) { EXPECT_NO_THROW(check(test::roomMap())); }

TEST(TtSdfMap, AnEmptyMapFailsTheCheck) { EXPECT_THROW(check(TtSdfMap{}), std::invalid_argument); }

TEST(TtSdfMap, MessagesSayGotAndWanted) {
  TtSdfMap map = test::roomMap(Dims(30, 21, 25));
  map.geometry.dims[2] = 26;
  try {
    check(map);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("got"), std::string::npos);
    EXPECT_NE(text.find("25"), std::string::npos);
    EXPECT_NE(text.find("wanted"), std::string::npos);
    EXPECT_NE(text.find("26"), std::string::npos);
  }
}

TEST(TtSdfMap, NamesOfFieldKindsAreTheirOwnInverse) {
  for (const FieldKind kind : {FieldKind::kSdf, FieldKind::kTsdf})
    EXPECT_EQ(fieldKindFromName(name(kind)), kind);
  EXPECT_THROW(fieldKindFromName("SDF"), std::invalid_argument);
}

TEST(TtSdfMap, ItsFieldAnswersInTheMapFrameAndKnowsTheMask) {
  const TtSdfMap map = test::roomMap();
  const auto field = makeField(map);
  Eigen::Matrix3Xf points(3, 2);
  points.col(0) = map.geometry.samplePosition({7.0, 5.0, 11.0}).cast<float>();
  points.col(1) = map.geometry.samplePosition({28.0, 5.0, 11.0}).cast<float>();  // beyond two thirds of x
  const FieldSamples samples = field->evaluate(points);
  EXPECT_EQ(samples.states[0], PointState::kValid);
  EXPECT_NEAR(samples.values[0], map.train(7, 5, 11), 1e-4);
  EXPECT_EQ(samples.states[1], PointState::kUnknown);
}

TEST(TtSdfMap, NoFieldWithoutASoundMap) {
  TtSdfMap map = test::roomMap();
  map.clamp_negative = -1.0;
  EXPECT_THROW(makeField(map), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf

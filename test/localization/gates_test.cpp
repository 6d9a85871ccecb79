#include "ttsdf_localization/localization/gates.h"

#include <gtest/gtest.h>

#include <limits>

namespace ttsdf {
namespace {

RegistrationResult goodResult() {
  RegistrationResult result;
  result.success = true;
  result.reason = TerminationReason::kConverged;
  result.points = 4000;
  result.inlier_ratio = 0.9;
  result.rms_residual = 0.01;
  result.inlier_distance = 0.05;
  result.confidence = result.fit_confidence = 0.9;
  return result;
}

TEST(Gates, AcceptAGoodFit) {
  EXPECT_FALSE(checkTermination(goodResult()));
  EXPECT_FALSE(checkFit(goodResult(), {}, 0.5));
  EXPECT_FALSE(checkJump({0.1, 0.05}, {}));
}

TEST(Gates, NameTheReasonOfEveryTermination) {
  const std::pair<TerminationReason, RejectionReason> pairs[] = {
      {TerminationReason::kConverged, RejectionReason::kNotConverged},
      {TerminationReason::kMaxIterations, RejectionReason::kNotConverged},
      {TerminationReason::kTooFewPoints, RejectionReason::kTooFewPoints},
      {TerminationReason::kOutsideMap, RejectionReason::kOutsideMap},
      {TerminationReason::kDegenerate, RejectionReason::kDegenerate},
      {TerminationReason::kAmbiguous, RejectionReason::kAmbiguous},
      {TerminationReason::kLowScore, RejectionReason::kLowScore},
      {TerminationReason::kCancelled, RejectionReason::kCancelled},
  };
  for (const auto& [termination, rejection] : pairs) {
    RegistrationResult result = goodResult();
    result.success = false;
    result.reason = termination;
    EXPECT_EQ(checkTermination(result).reason, rejection) << name(termination);
    EXPECT_FALSE(checkTermination(result).message.empty());
  }
}

TEST(Gates, RejectEachBadFigure) {
  RegistrationResult result = goodResult();
  result.rms_residual = 0.2;
  EXPECT_EQ(checkFit(result, {}, 0.5).reason, RejectionReason::kResidual);
  result = goodResult();
  result.inlier_ratio = 0.4;
  EXPECT_EQ(checkFit(result, {}, 0.5).reason, RejectionReason::kInliers);
  result = goodResult();
  result.outside_ratio = 0.5;
  result.unknown_ratio = 0.4;
  EXPECT_EQ(checkFit(result, {}, 0.5).reason, RejectionReason::kOutsideMap);
  result = goodResult();
  result.confidence = result.fit_confidence = 0.05;
  EXPECT_EQ(checkFit(result, {}, 0.5).reason, RejectionReason::kLowScore);
  result = goodResult();
  result.degenerate_directions = 4;
  EXPECT_EQ(checkFit(result, {}, 0.5).reason, RejectionReason::kDegenerate);
  EXPECT_EQ(checkJump({0.6, 0.0}, {}).reason, RejectionReason::kJump);
  EXPECT_EQ(checkJump({0.0, 0.6}, {}).reason, RejectionReason::kJump);
}

// A degenerate scan is never confident of the whole pose. It may be used with its prior, but only if what it
// fixes fits.
TEST(Gates, ADegenerateScanHasToFitToo) {
  RegistrationResult result = goodResult();
  result.success = false;
  result.reason = TerminationReason::kDegenerate;
  result.degenerate_directions = 1;
  result.confidence = 0.0;
  EXPECT_FALSE(checkTermination(result));
  EXPECT_FALSE(checkFit(result, {}, 0.5));
  result.fit_confidence = 0.05;
  EXPECT_EQ(checkFit(result, {}, 0.5).reason, RejectionReason::kLowScore);
}

// A scan outside the map has nothing to disagree with: a residual of zero must not look like a perfect fit.
TEST(Gates, RejectAPerfectResidualOutsideTheMap) {
  RegistrationResult result = goodResult();
  result.rms_residual = 0.0;
  result.outside_ratio = 1.0;
  EXPECT_EQ(checkFit(result, {}, 0.5).reason, RejectionReason::kOutsideMap);
}

TEST(Gates, RejectNan) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  RegistrationResult result = goodResult();
  result.rms_residual = nan;
  EXPECT_TRUE(checkFit(result, {}, 0.5));
  result = goodResult();
  result.inlier_ratio = nan;
  EXPECT_TRUE(checkFit(result, {}, 0.5));
  result = goodResult();
  result.outside_ratio = nan;
  EXPECT_TRUE(checkFit(result, {}, 0.5));
  result = goodResult();
  result.T_map_sensor.translation().x() = nan;
  EXPECT_TRUE(checkFit(result, {}, 0.5));
  EXPECT_TRUE(checkJump({nan, 0.0}, {}));
}

}  // namespace
}  // namespace ttsdf

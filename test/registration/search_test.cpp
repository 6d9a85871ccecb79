// Many starts: around a prior and over the whole map.

#include "ttsdf_localization/registration/search.h"

#include <gtest/gtest.h>

#include "../../src/registration/multi_start/multi_start.h"
#include "analytic_world.h"

namespace ttsdf {
namespace {

using test::castRays;
using test::furnishedRoom;
using test::perturbed;
using test::roomPose;

std::shared_ptr<const DistanceField> roomField(const test::Sdf& sdf = furnishedRoom) {
  return test::denseField(sdf, test::roomGeometry(0.05));
}

GlobalOptions fewStarts() {
  GlobalOptions options;  // a room of 4 x 3 m needs less than a house
  options.starts = 1500;
  options.refined = 20;
  return options;
}

const Eigen::Vector3d kMapDown = -Eigen::Vector3d::UnitZ();

Eigen::Vector3d gravityIn(const Eigen::Isometry3d& T_map_sensor) {
  return T_map_sensor.linear().transpose() * kMapDown;
}

TEST(BestDistinct, KeepsTheBestOfEveryPlace) {
  const auto at = [](double x, double score) {
    Candidate c;
    c.T_map_sensor.translation().x() = x;
    c.score = score;
    return c;
  };
  const auto kept =
      bestDistinct({at(0.0, 0.5), at(0.01, 0.2), at(1.0, 0.4), at(1.02, 0.6), at(5.0, 0.3)}, 10, 0.05, 0.05);
  ASSERT_EQ(kept.size(), 3u);
  EXPECT_EQ(kept[0].score, 0.2);
  EXPECT_EQ(kept[1].score, 0.3);
  EXPECT_EQ(kept[2].score, 0.4);
  EXPECT_EQ(bestDistinct({at(0.0, 0.5), at(1.0, 0.2)}, 1, 0.05, 0.05).size(), 1u);
  EXPECT_TRUE(bestDistinct({}, 3, 0.05, 0.05).empty());
  EXPECT_TRUE(bestDistinct({at(0.0, 1.0)}, 3, 0.05, 0.05).empty()) << "never reached";
}

TEST(DescendAll, GivesTheSameResultsWithAnyNumberOfThreads) {
  const auto field = roomField();
  ScanBuffer scan;
  scan.assign(castRays(furnishedRoom, roomPose(1), test::directions(300)), 300);
  std::vector<Eigen::Isometry3d> starts;
  for (unsigned n = 0; n < 100; ++n) starts.push_back(perturbed(roomPose(1), 0.5, 0.3, n));
  DescentOptions options;
  options.scales = {0.5, 0.3, 0.15};
  const auto one = descendAll(*field, scan, starts, options);
  for (const int threads : {2, 3, 8}) {
    options.threads = threads;
    const auto many = descendAll(*field, scan, starts, options);
    for (std::size_t n = 0; n < starts.size(); ++n) {
      EXPECT_EQ(one[n].T_map_sensor.matrix(), many[n].T_map_sensor.matrix());
      EXPECT_EQ(one[n].score, many[n].score);
    }
  }
}

TEST(DescendAll, EndsWhenAskedTo) {
  const auto field = roomField();
  ScanBuffer scan;
  scan.assign(castRays(furnishedRoom, roomPose(1), test::directions(300)), 300);
  const std::vector<Eigen::Isometry3d> starts(500, roomPose(1));
  DescentOptions options;
  options.scales = {0.5};
  const auto results = descendAll(*field, scan, starts, options, [](std::size_t) { return false; });
  ASSERT_EQ(results.size(), starts.size());
  EXPECT_LT(results.front().score, 0.1);
  EXPECT_EQ(results.back().score, 1.0) << "not reached";
}

// One descent may end in a local minimum beside the place; from around it others do not.
TEST(MultiStart, RetriesFindPlacesThatOneDescentMisses) {
  Registration registration(roomField());
  int missed = 0, found_again = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    const Eigen::Isometry3d truth = roomPose(seed);
    const Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::directions(600));
    const MultiStart search(registration, points, 300);
    const auto finds = [&](int retries) {
      MultiStart::Options options;
      options.retries = retries;
      const GridGeometry& geometry = registration.field().geometry();
      const auto places = search.places({relativeTo(geometry, perturbed(truth, 0.6, 1.1, seed))}, options);
      return std::any_of(places.begin(), places.end(), [&](const Eigen::Isometry3d& T) {
        const PoseError e = poseError(truth, T);
        return e.translation < 0.1 && e.rotation < 0.1;
      });
    };
    if (finds(0)) {
      EXPECT_TRUE(finds(16)) << "what is found stays, seed " << seed;
    } else {
      ++missed;
      if (finds(16)) ++found_again;
    }
  }
  ASSERT_GT(missed, 0) << "the starts are too easy to show anything";
  EXPECT_GT(found_again, missed / 4);
}

TEST(SearchNear, FindsTheScanFromFarAway) {
  Registration registration(roomField());
  for (unsigned seed = 0; seed < 10; ++seed) {
    const Eigen::Isometry3d truth = roomPose(seed);
    const RegistrationResult result =
        searchNear(registration, castRays(furnishedRoom, truth, test::directions(1500)),
                   perturbed(truth, 0.8, 0.3, seed), {});
    EXPECT_TRUE(result.success) << seed;
    EXPECT_LT(poseError(truth, result.T_map_sensor).translation, 0.01) << seed;
    EXPECT_LT(poseError(truth, result.T_map_sensor).rotation, 0.01) << seed;
  }
}

TEST(SearchNear, SpreadsItsStartsByTheCovariance) {
  Registration registration(roomField());
  const Eigen::Isometry3d truth = roomPose(4);
  const Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::directions(1500));
  Eigen::Isometry3d prior = truth;
  prior.linear() = expSo3(Eigen::Vector3d(0.0, 0.0, 2.0)) * truth.linear();  // yaw is all but unknown
  Matrix6d covariance = Matrix6d::Identity() * 1e-4;
  covariance(2, 2) = 4.0;
  const RegistrationResult result = searchNear(registration, points, prior, {}, covariance);
  EXPECT_TRUE(result.success);
  EXPECT_LT(poseError(truth, result.T_map_sensor).translation, 0.02);
  EXPECT_LT(poseError(truth, result.T_map_sensor).rotation, 0.02);
}

// One wall does not fix the place along it: what a search finds there is no success.
TEST(SearchNear, RefusesAViewThatFixesNoPose) {
  Registration registration(roomField());
  const Eigen::Isometry3d truth = roomPose(4);  // sees one wall
  const Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::cameraDirections(50, 30));
  const RegistrationResult result = searchNear(registration, points, perturbed(truth, 0.3, 0.1, 1), {});
  EXPECT_FALSE(result.success);
  EXPECT_EQ(result.reason, TerminationReason::kDegenerate);
  EXPECT_GE(result.degenerate_directions, 3);
}

TEST(SearchNear, RepeatsItselfAndRefusesWhatAlignRefuses) {
  const auto field = roomField();
  const Eigen::Isometry3d truth = roomPose(2), prior = perturbed(truth, 0.5, 0.2, 1);
  const Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::directions(800));
  Registration a(field), b(field);
  EXPECT_EQ(searchNear(a, points, prior, {}).T_map_sensor.matrix(),
            searchNear(b, points, prior, {}).T_map_sensor.matrix());
  EXPECT_EQ(searchNear(a, points.leftCols(3), prior, {}).reason, TerminationReason::kTooFewPoints);
  EXPECT_EQ(searchNear(a, points.leftCols(30), prior, {}).reason, TerminationReason::kTooFewPoints);
  SearchOptions options;
  options.starts = 0;
  EXPECT_THROW(searchNear(a, points, prior, options), std::invalid_argument);
}

TEST(LocalizeGlobally, FindsTheScanWithGravityAlone) {
  Registration registration(roomField());
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Eigen::Isometry3d truth = roomPose(seed);
    // The hint is off by 0.05 rad, as an accelerometer's may be.
    const Eigen::Vector3d gravity = expSo3(Eigen::Vector3d(0.05, 0.0, 0.0)) * gravityIn(truth);
    const RegistrationResult result = localizeGlobally(
        registration, castRays(furnishedRoom, truth, test::directions(1500)), gravity, kMapDown, fewStarts());
    EXPECT_TRUE(result.success) << seed << ": " << name(result.reason);
    EXPECT_LT(poseError(truth, result.T_map_sensor).translation, 0.01) << seed;
    EXPECT_GT(result.runner_up_score, result.score) << seed;
  }
}

TEST(LocalizeGlobally, FindsTheScanWithoutAnyHint) {
  Registration registration(roomField());
  GlobalOptions options = fewStarts();
  options.starts_without_gravity = 8000;
  const Eigen::Isometry3d truth = roomPose(1);
  const RegistrationResult result = localizeGlobally(
      registration, castRays(furnishedRoom, truth, test::directions(1500)), std::nullopt, kMapDown, options);
  EXPECT_TRUE(result.success) << name(result.reason);
  EXPECT_LT(poseError(truth, result.T_map_sensor).translation, 0.01);
}

TEST(LocalizeGlobally, SaysWhenTwoPlacesLookAlike) {
  // An empty rectangular room looks the same after half a turn.
  Registration registration(roomField(test::emptyRoom));
  Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  truth.translation() = Eigen::Vector3d(1.2, 0.9, 1.0);
  const RegistrationResult result =
      localizeGlobally(registration, castRays(test::emptyRoom, truth, test::directions(1500)),
                       gravityIn(truth), kMapDown, fewStarts());
  EXPECT_FALSE(result.success);
  EXPECT_EQ(result.reason, TerminationReason::kAmbiguous);
  // Best and runner-up are the two places, in either order.
  Eigen::Isometry3d turned = truth;
  turned.translation() = Eigen::Vector3d(2.8, 2.1, 1.0);
  turned.linear() = expSo3(Eigen::Vector3d(0.0, 0.0, M_PI)) * truth.linear();
  const bool swapped = poseError(turned, result.T_map_sensor).translation < 0.05;
  EXPECT_LT(poseError(swapped ? turned : truth, result.T_map_sensor).translation, 0.05);
  EXPECT_LT(poseError(swapped ? truth : turned, result.T_map_runner_up).translation, 0.05);
}

TEST(LocalizeGlobally, RefusesAScanOfAnotherPlace) {
  Registration registration(roomField());
  const auto ball = [](const Eigen::Vector3d& p) { return 1.1 - p.norm(); };
  const Eigen::Matrix3Xf points = castRays(ball, Eigen::Isometry3d::Identity(), test::directions(1000));
  const RegistrationResult result = localizeGlobally(
      registration, points, Eigen::Vector3d(-Eigen::Vector3d::UnitZ()), kMapDown, fewStarts());
  EXPECT_FALSE(result.success);
  EXPECT_TRUE(result.reason == TerminationReason::kLowScore || result.reason == TerminationReason::kAmbiguous)
      << name(result.reason);
}

TEST(LocalizeGlobally, GivesTheSameResultWithAnyNumberOfThreads) {
  const auto field = roomField();
  const Eigen::Isometry3d truth = roomPose(3);
  const Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::directions(800));
  GlobalOptions options = fewStarts();
  options.starts = 400;
  std::vector<RegistrationResult> results;
  for (const int threads : {1, 2, 5}) {
    options.threads = threads;
    Registration registration(field);
    results.push_back(localizeGlobally(registration, points, gravityIn(truth), kMapDown, options));
  }
  for (const auto& result : results) {
    EXPECT_EQ(result.T_map_sensor.matrix(), results.front().T_map_sensor.matrix());
    EXPECT_EQ(result.score, results.front().score);
    EXPECT_EQ(result.runner_up_score, results.front().runner_up_score);
  }
}

TEST(LocalizeGlobally, ReportsProgressAndCanBeCancelled) {
  Registration registration(roomField());
  const Eigen::Isometry3d truth = roomPose(3);
  const Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::directions(500));
  GlobalOptions options = fewStarts();
  options.starts = 300;
  std::vector<double> shares;
  localizeGlobally(registration, points, gravityIn(truth), kMapDown, options, [&](double share) {
    shares.push_back(share);
    return true;
  });
  ASSERT_GT(shares.size(), 5u);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_GE(shares.front(), 0.0);
  EXPECT_LE(shares.back(), 1.0);
  int asked = 0;
  const RegistrationResult cancelled = localizeGlobally(registration, points, gravityIn(truth), kMapDown,
                                                        options, [&](double) { return ++asked < 3; });
  EXPECT_EQ(cancelled.reason, TerminationReason::kCancelled);
  EXPECT_FALSE(cancelled.success);
  EXPECT_LE(asked, 4) << "ends soon";
}

TEST(LocalizeGlobally, LetsAnExceptionOfTheProgressCallbackThrough) {
  Registration registration(roomField());
  const Eigen::Isometry3d truth = roomPose(3);
  const Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::directions(500));
  GlobalOptions options = fewStarts();
  options.starts = 300;
  for (const int threads : {1, 2, 5}) {
    options.threads = threads;
    const auto fails = [](double) -> bool { throw std::runtime_error("the window is gone"); };
    EXPECT_THROW(localizeGlobally(registration, points, gravityIn(truth), kMapDown, options, fails),
                 std::runtime_error);
  }
}

TEST(LocalizeGlobally, HandlesScansThatAreTooShort) {
  Registration registration(roomField());
  const Eigen::Isometry3d truth = roomPose(3);
  const Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::directions(500));
  const RegistrationResult few =
      localizeGlobally(registration, points.leftCols(20), gravityIn(truth), kMapDown, fewStarts());
  EXPECT_EQ(few.reason, TerminationReason::kTooFewPoints);
  EXPECT_FALSE(few.success);
  GlobalOptions options = fewStarts();
  options.threads = 0;
  EXPECT_THROW(localizeGlobally(registration, points, gravityIn(truth), kMapDown, options),
               std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf

#include "ttsdf_localization/evaluation/fast_global_registration.h"

#include <gtest/gtest.h>

#include <random>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {
namespace {

// Points in a box, their images under a random motion anywhere in SO(3), and pairs of which a share is wrong.
struct Problem {
  Eigen::Matrix3Xf source, target;
  Eigen::Isometry3d T_target_source;
  std::vector<Correspondence> matches;
};

Problem makeProblem(int points, double wrong_share, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::normal_distribution<double> normal;
  Problem problem;
  const Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
  problem.T_target_source = Eigen::Isometry3d(q.normalized());
  problem.T_target_source.pretranslate(
      Eigen::Vector3d(5.0 * uniform(random), 5.0 * uniform(random), 5.0 * uniform(random)));
  problem.source.resize(3, points);
  problem.target.resize(3, points);
  for (int n = 0; n < points; ++n) {
    const Eigen::Vector3d p(2.0 * uniform(random), uniform(random), uniform(random));
    const Eigen::Vector3d e(noise * normal(random), noise * normal(random), noise * normal(random));
    problem.source.col(n) = p.cast<float>();
    problem.target.col(n) = (problem.T_target_source * p + e).cast<float>();
    const bool wrong = n < wrong_share * points;
    problem.matches.emplace_back(n, wrong ? static_cast<int>(random() % static_cast<unsigned>(points)) : n);
  }
  return problem;
}

PoseError errorOf(const Problem& problem, const std::vector<Correspondence>& matches,
                  const FastGlobalOptions& options = {}) {
  return poseError(problem.T_target_source,
                   alignCorrespondences(problem.source, problem.target, matches, options));
}

TEST(FastGlobalRegistration, FindsAnyMotionFromRightPairs) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Problem problem = makeProblem(100, 0.0, 0.0, seed);
    const PoseError error = errorOf(problem, problem.matches);
    EXPECT_LT(error.translation, 1e-4) << seed;
    EXPECT_LT(error.rotation, 1e-5) << seed;
  }
}

// Oracle: the closed solution of the right pairs (Umeyama), which knows which pairs are wrong.
TEST(FastGlobalRegistration, AgreesWithUmeyamaOfTheRightPairsDespiteWrongOnes) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const double wrong = 0.5;
    const Problem problem = makeProblem(400, wrong, 0.01, seed);
    const Eigen::Index first = static_cast<Eigen::Index>(wrong * 400);
    const Eigen::Matrix4d oracle =
        Eigen::umeyama(problem.source.rightCols(400 - first).cast<double>(),
                       problem.target.rightCols(400 - first).cast<double>(), false);
    const PoseError error = poseError(
        Eigen::Isometry3d(oracle), alignCorrespondences(problem.source, problem.target, problem.matches, {}));
    EXPECT_LT(error.translation, 0.01) << seed;
    EXPECT_LT(error.rotation, 0.01) << seed;
  }
}

TEST(FastGlobalRegistration, TupleTestRaisesTheShareOfRightPairs) {
  const Problem problem = makeProblem(300, 0.8, 0.002, 3);
  const auto kept = tupleTest(problem.source, problem.target, problem.matches, {});
  ASSERT_GE(kept.size(), 30u);
  std::size_t right = 0;
  for (const auto& match : kept) right += match.first == match.second ? 1 : 0;
  EXPECT_GT(static_cast<double>(right) / static_cast<double>(kept.size()), 0.4);
  const PoseError error = errorOf(problem, kept);
  EXPECT_LT(error.translation, 0.01);
}

TEST(FastGlobalRegistration, TupleTestRefusesTrianglesOfAnotherSize) {
  Problem problem = makeProblem(50, 0.0, 0.0, 1);
  problem.target *= 1.2f;
  EXPECT_TRUE(tupleTest(problem.source, problem.target, problem.matches, {}).empty());
}

TEST(FastGlobalRegistration, MutualMatchesAreThoseThatAgree) {
  const auto matches = mutualMatches({2, 0, -1, 1}, {3, 3, 0});
  const std::vector<Correspondence> wanted{{0, 2}, {3, 1}};
  EXPECT_EQ(matches, wanted);
}

TEST(FastGlobalRegistration, TooFewPairsAreRefused) {
  const Problem problem = makeProblem(2, 0.0, 0.0, 1);
  EXPECT_THROW(alignCorrespondences(problem.source, problem.target, problem.matches, {}),
               std::invalid_argument);
  EXPECT_TRUE(tupleTest(problem.source, problem.target, problem.matches, {}).empty());
}

}  // namespace
}  // namespace ttsdf

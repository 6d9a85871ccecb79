// Two maps of one analytic world against one map of both.

#include "ttsdf_localization/atlas/atlas_field.h"

#include <gtest/gtest.h>

#include <cmath>

#include "atlas_world.h"
#include "ttsdf_localization/field/long_range_field.h"
#include "ttsdf_localization/registration/registration.h"

namespace ttsdf::test {
namespace {

const Eigen::Vector3d kLow(-0.3, -0.3, -0.3), kHigh(8.3, 3.3, 2.7);
const Eigen::Vector3d kUtm(356789.0, 5412345.0, 123.0);

PlacedField placed(const Eigen::Vector3d& low, const Eigen::Vector3d& high, const Eigen::Isometry3d& T,
                   const std::string& name, int rank = 40) {
  PlacedField map;
  map.name = name;
  map.T_atlas_map = T;
  map.field = makeField(partOf(twoRooms, low, high, T, 0.05, rank));
  map.far = makeLongRangeField(*map.field);
  return map;
}

Eigen::Isometry3d shifted(Eigen::Isometry3d T, const Eigen::Vector3d& by) {
  T.translation() += by;
  return T;
}

/// The world as one map, and as two that overlap by a metre, the second one in a frame of its own.
class TwoMaps : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    left = placed(kLow, {4.5, 3.3, 2.7}, Eigen::Isometry3d::Identity(), "left");
    right = placed({3.5, -0.3, -0.3}, kHigh, turnedBy(0.7, {3.0, 1.0, 0.2}), "right");
    one = placed(kLow, kHigh, Eigen::Isometry3d::Identity(), "both", 60);  // twice as long, more to say
  }
  static PlacedField left, right, one;
};
PlacedField TwoMaps::left, TwoMaps::right, TwoMaps::one;

Eigen::Matrix3Xd randomPoints(int count) {
  return ((Eigen::Matrix3Xd::Random(3, count).array() + 1.0) / 2.0).matrix();
}

TEST_F(TwoMaps, ValuesAndGradientsAreThoseOfTheWorld) {
  const AtlasField atlas({left, right});
  const Eigen::Matrix3Xd points = (((kHigh - kLow).asDiagonal() * (0.98 * randomPoints(4000))).colwise() +
                                   kLow + 0.05 * Eigen::Vector3d::Ones())
                                      .eval();
  const FieldSamples samples = atlas.evaluate(points.cast<float>());
  double sum = 0.0, slope = 0.0;
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    ASSERT_EQ(samples.states[static_cast<std::size_t>(n)], PointState::kValid);
    const Eigen::Vector3d p = points.col(n);
    sum += std::pow(samples.values[n] - twoRooms(p), 2);
    Eigen::Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d h = 0.02 * Eigen::Vector3d::Unit(axis);
      gradient[axis] = (twoRooms(p + h) - twoRooms(p - h)) / 0.04;
    }
    slope += (samples.gradients.col(n).cast<double>() - gradient).norm();
  }
  EXPECT_LT(std::sqrt(sum / static_cast<double>(points.cols())), 0.01);
  EXPECT_LT(slope / static_cast<double>(points.cols()), 0.15);
}

TEST_F(TwoMaps, APointIsAnsweredByTheMapThatHoldsItDeepest) {
  const AtlasField atlas({left, right});
  const FieldSamples both = atlas.evaluate(Eigen::Matrix3Xf(Eigen::Vector3f(3.7F, 1.5F, 1.0F)));
  const AtlasField only_left({left});
  const FieldSamples alone = only_left.evaluate(Eigen::Matrix3Xf(Eigen::Vector3f(3.7F, 1.5F, 1.0F)));
  EXPECT_EQ(both.values[0], alone.values[0]);
}

TEST_F(TwoMaps, KnownBeforeUnknownBeforeOutside) {
  // The left map again, but it knows nothing; it reaches further out, so that points lie deeper in it.
  PlacedField blind;
  const TtSdfMap map =
      partOf(twoRooms, {-2.0, -2.0, -2.0}, {5.5, 5.0, 4.0}, Eigen::Isometry3d::Identity(), 0.1);
  blind.field = makeField([&map] {
    TtSdfMap copy = map;
    copy.mask = SupportMask(copy.geometry.dims, 4, false);
    return copy;
  }());
  const AtlasField atlas({blind, left});
  Eigen::Matrix3Xf points(3, 4);
  points << 2.0F, 5.2F, 7.0F, NAN, 1.5F, 1.5F, 1.5F, 0.0F, 1.0F, 1.0F, 1.0F, 0.0F;
  const FieldSamples samples = atlas.evaluate(points);
  EXPECT_EQ(samples.states, (std::vector<PointState>{PointState::kValid, PointState::kUnknown,
                                                     PointState::kOutside, PointState::kOutside}));
  EXPECT_NEAR(samples.values[0], twoRooms({2.0, 1.5, 1.0}), 0.03);
}

TEST_F(TwoMaps, TheFarFieldShowsTheNearestSurfaceOfAnyMap) {
  const auto far = AtlasField({left, right}).farField();
  ASSERT_NE(far, nullptr);
  const Eigen::Matrix3Xd points = ((kHigh - kLow).asDiagonal() * randomPoints(2000)).colwise() + kLow;
  const FieldSamples samples = far->evaluate(points.cast<float>());
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    ASSERT_EQ(samples.states[static_cast<std::size_t>(n)], PointState::kValid);
    if (twoRooms(points.col(n)) < 0.1) continue;
    EXPECT_NEAR(samples.values[n], twoRooms(points.col(n)), 0.12) << points.col(n).transpose();
  }
  EXPECT_GT(far->evaluate(Eigen::Matrix3Xf(Eigen::Vector3f(10.0F, 1.5F, 1.0F))).values.cwiseAbs()[0], 1.5F);
}

/// Keeps what it is told to prepare.
class Listener final : public DistanceField {
 public:
  explicit Listener(std::shared_ptr<const DistanceField> inner) : inner_(std::move(inner)) {}
  const GridGeometry& geometry() const override { return inner_->geometry(); }
  using DistanceField::evaluate;
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override {
    inner_->evaluate(points, samples);
  }
  std::size_t memoryBytes() const override { return inner_->memoryBytes(); }
  void prepare(const PointSpan& points) const override {
    ++calls;
    for (int n = 0; n < points.size; ++n) prepared.emplace_back(points.x[n], points.y[n], points.z[n]);
  }
  mutable std::vector<Eigen::Vector3f> prepared;
  mutable int calls = 0;

 private:
  std::shared_ptr<const DistanceField> inner_;
};

TEST_F(TwoMaps, AScanIsPreparedInTheMapsThatAnswerIt) {
  const auto in_left = std::make_shared<Listener>(left.field),
             in_right = std::make_shared<Listener>(right.field);
  PlacedField a = left, b = right;
  a.field = in_left, b.field = in_right;
  const AtlasField atlas({a, b});
  // Left only, both (deeper in the left one), both (deeper in the right one), right only, nowhere, no point.
  const std::vector<float> x{1.0F, 3.7F, 4.3F, 7.0F, 30.0F, NAN}, y(6, 1.5F), z(6, 1.0F);
  const Eigen::Vector3f origin = atlas.geometry().origin.cast<float>();
  std::vector<float> px, py, pz;
  for (std::size_t n = 0; n < x.size(); ++n)
    px.push_back(x[n] - origin.x()), py.push_back(y[n] - origin.y()), pz.push_back(z[n] - origin.z());
  static_cast<const DistanceField&>(atlas).prepare(PointSpan{px.data(), py.data(), pz.data(), 6});
  const auto expectPlaces = [&](const Listener& listener, const PlacedField& map,
                                std::vector<double> wanted) {
    EXPECT_EQ(listener.calls, 1);  // all at once
    ASSERT_EQ(listener.prepared.size(), wanted.size());
    for (std::size_t n = 0; n < wanted.size(); ++n) {
      const Eigen::Vector3d p_map = listener.prepared[n].cast<double>() + map.field->geometry().origin;
      EXPECT_LT((map.T_atlas_map * p_map - Eigen::Vector3d(wanted[n], 1.5, 1.0)).norm(), 1e-5) << n;
    }
  };
  expectPlaces(*in_left, a, {1.0, 3.7});
  expectPlaces(*in_right, b, {4.3, 7.0});
}

// Acceptance: crossing a border moves the pose by less than 2 mm against one map of both.
TEST_F(TwoMaps, CrossingTheBorderDoesNotMoveThePose) {
  const auto atlas = std::make_shared<const AtlasField>(std::vector<PlacedField>{left, right});
  Registration in_two(atlas, {}, atlas->farField()), in_one(one.field, {}, one.far);
  double worst = 0.0, worst_truth = 0.0;
  // Further on the camera sees nothing but the end wall.
  for (double x = 2.0; x <= 5.4; x += 0.125) {
    Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
    truth.translation() << x, 1.6, 1.3;
    // Level, looking along the way.
    truth.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    truth.linear() = Eigen::AngleAxisd(0.5 * std::sin(3.0 * x), Eigen::Vector3d::UnitZ()).toRotationMatrix() *
                     truth.linear();
    const ScanPoints scan = castRays(twoRooms, truth, cameraDirections(60, 45));
    const Eigen::Isometry3d prior = perturbed(truth, 0.03, 0.02, static_cast<unsigned>(100.0 * x));
    const RegistrationResult two = in_two.align(scan, prior), single = in_one.align(scan, prior);
    EXPECT_TRUE(two.success) << x << ' ' << name(two.reason);
    worst = std::max(worst, poseError(two.T_map_sensor, single.T_map_sensor).translation);
    worst_truth = std::max(worst_truth, poseError(two.T_map_sensor, truth).translation);
  }
  EXPECT_LT(worst, 0.002);
  RecordProperty("worst_um", static_cast<int>(1e6 * worst));
  RecordProperty("worst_truth_um", static_cast<int>(1e6 * worst_truth));
  EXPECT_LT(worst_truth, 0.003);
}

TEST_F(TwoMaps, CoordinatesOfASurveyWillDo) {
  PlacedField a = left, b = right;
  a.T_atlas_map = shifted(a.T_atlas_map, kUtm), b.T_atlas_map = shifted(b.T_atlas_map, kUtm);
  const auto near = std::make_shared<const AtlasField>(std::vector<PlacedField>{left, right});
  const auto far = std::make_shared<const AtlasField>(std::vector<PlacedField>{a, b});
  Registration here(near, {}, near->farField()), there(far, {}, far->farField());
  Eigen::Isometry3d truth = turnedBy(0.3, {3.0, 1.8, 1.2});
  const ScanPoints scan = castRays(twoRooms, truth, directions(1500));
  const auto prior = perturbed(truth, 0.05, 0.03, 4);
  const auto found = here.align(scan, prior), far_off = there.align(scan, shifted(prior, kUtm));
  EXPECT_TRUE(far_off.success);
  EXPECT_LT(poseError(shifted(found.T_map_sensor, kUtm), far_off.T_map_sensor).translation, 5e-4);
}

TEST_F(TwoMaps, RefusesWhatIsNoMap) {
  EXPECT_THROW(AtlasField({}), std::invalid_argument);
  EXPECT_THROW(AtlasField({PlacedField{}}), std::invalid_argument);
  PlacedField bent = left;
  bent.T_atlas_map.linear() *= 2.0;
  EXPECT_THROW(AtlasField({bent}), std::invalid_argument);
}

TEST_F(TwoMaps, CopiesOfAMapAreCountedOnce) {
  EXPECT_EQ(AtlasField({left, left}).memoryBytes(), left.field->memoryBytes());
}

}  // namespace
}  // namespace ttsdf::test

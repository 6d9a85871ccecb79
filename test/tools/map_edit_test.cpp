#include "ttsdf_localization/tools/map_edit.h"

#include <gtest/gtest.h>

#include <random>

#include "box_room.h"
#include "ttsdf_localization/field/dense_distance_field.h"

namespace ttsdf {
namespace {

// Points in a box of the map frame.
Eigen::Matrix3Xf randomPoints(const Eigen::AlignedBox3d& box, int count) {
  std::mt19937 random(3);
  const auto uniform = [&random] { return static_cast<double>(random()) / 4294967296.0; };
  Eigen::Matrix3Xf points(3, count);
  for (int n = 0; n < count; ++n) {
    const Eigen::Array3d share(uniform(), uniform(), uniform());
    points.col(n) = (box.min().array() + share * box.sizes().array()).matrix().cast<float>();
  }
  return points;
}

void expectSameField(const TtSdfMap& wanted, const TtSdfMap& got, const Eigen::AlignedBox3d& box,
                     float tolerance) {
  const auto points = randomPoints(box, 2000);
  // As full arrays: the compressed field rounds what it keeps decoded.
  const auto field = [](const TtSdfMap& map) {
    return DenseDistanceField(full(map.train), map.geometry, map.mask);
  };
  const auto a = field(wanted).evaluate(points), b = field(got).evaluate(points);
  EXPECT_LT((a.values - b.values).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_EQ(a.states, b.states);
}

const Eigen::AlignedBox3d kInside(Eigen::Vector3d(0.3, 0.3, 0.3), Eigen::Vector3d(2.6, 1.6, 2.0));

TEST(CropMap, KeepsFieldAndPlace) {
  auto map = roomMap();
  map.mask = SupportMask(map.geometry.dims, 4, true);
  map.mask.set(5, 4, 4, false);
  const auto part = cropped(map, kInside);
  check(part);
  EXPECT_LT(part.geometry.voxelCount(), map.geometry.voxelCount() / 2);
  expectSameField(map, part, kInside, 1e-4f);
}

TEST(CropMap, StaysInsideTheMapAndRefusesWhatMissesIt) {
  const auto map = roomMap();
  const auto all = cropped(map, {Eigen::Vector3d::Constant(-9.0), Eigen::Vector3d::Constant(9.0)});
  EXPECT_TRUE((all.geometry.dims == map.geometry.dims).all());
  const auto thin = cropped(map, {Eigen::Vector3d(1.01, 0.3, 0.3), Eigen::Vector3d(1.02, 1.0, 1.0)});
  EXPECT_GE(thin.geometry.dims[0], 2);
  EXPECT_THROW(cropped(map, {Eigen::Vector3d::Constant(5.0), Eigen::Vector3d::Constant(6.0)}),
               std::invalid_argument);
  EXPECT_THROW(cropped(map, {Eigen::Vector3d::Constant(2.0), Eigen::Vector3d::Constant(1.0)}),
               std::invalid_argument);
}

TEST(RecompressMap, KeepsEverythingButTheRanks) {
  const auto map = roomMap();
  TtSvdOptions options;
  options.max_rank1 = 8;
  options.max_rank2 = 6;
  const auto smaller = recompressed(map, options);
  check(smaller);
  EXPECT_EQ(smaller.train.rank1(), 8);
  EXPECT_EQ(smaller.train.rank2(), 6);
  EXPECT_EQ(smaller.geometry.T_map_grid.matrix(), map.geometry.T_map_grid.matrix());
  EXPECT_DOUBLE_EQ(smaller.truncation, map.truncation);
}

// The room cut into two overlapping halves, the second one moved to a frame of its own, and joined again.
TEST(MergeMaps, TwoHalvesAreTheWhole) {
  const auto whole = roomMap();
  const auto left = cropped(whole, {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1.6, 3, 3)});
  auto right = cropped(whole, {Eigen::Vector3d(1.4, -1, -1), Eigen::Vector3d(4, 3, 3)});
  Eigen::Isometry3d T_left_right = Eigen::Isometry3d::Identity();
  T_left_right.translate(Eigen::Vector3d(5.0, -1.0, 2.0))
      .rotate(Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitZ()));
  right.geometry.T_map_grid = T_left_right.inverse() * right.geometry.T_map_grid;
  const auto joined = merged(left, right, T_left_right, {});
  check(joined);
  EXPECT_TRUE((joined.geometry.dims == whole.geometry.dims).all()) << joined.geometry.dims.transpose();
  expectSameField(whole, joined, kInside, 2e-3f);
}

// Where maps contradict each other, the nearer surface counts; where neither reaches, nothing is known.
TEST(MergeMaps, NearerSurfaceWinsAndTheRestIsUnknown) {
  const auto room = roomMap();
  auto beside = cropped(room, {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)});
  Eigen::Isometry3d T_room_beside = Eigen::Isometry3d::Identity();
  T_room_beside.translation() << 4.0, 0.0, 0.0;
  const auto joined = merged(room, beside, T_room_beside, {});
  Eigen::Matrix3Xf points(3, 3);
  points.col(0) << 1.0f, 1.0f, 2.0f;  // in the room
  points.col(1) << 4.5f, 0.5f, 0.5f;  // in the other map
  points.col(2) << 4.5f, 1.5f, 2.0f;  // in the box of both, in neither map
  const auto samples = makeField(joined)->evaluate(points);
  EXPECT_NEAR(samples.values[0], 0.4f, 2e-3f);
  EXPECT_NEAR(samples.values[1], 0.5f, 2e-3f);
  EXPECT_EQ(samples.states[0], PointState::kValid);
  EXPECT_EQ(samples.states[1], PointState::kValid);
  EXPECT_EQ(samples.states[2], PointState::kUnknown);
}

TEST(MergeMaps, RefusesOtherKindsAndAbsurdDistances) {
  const auto room = roomMap();
  auto other = room;
  other.kind = FieldKind::kTsdf;
  EXPECT_THROW(merged(room, other, Eigen::Isometry3d::Identity(), {}), std::invalid_argument);
  Eigen::Isometry3d far = Eigen::Isometry3d::Identity();
  far.translation() << 1e4, 1e4, 1e4;
  EXPECT_THROW(merged(room, room, far, {}), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf

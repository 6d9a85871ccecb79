// Two rooms that look the same, each with another one behind it: which of them a robot is in shows when it
// drives on.

#include "ttsdf_localization/atlas/moving_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>

#include "atlas_world.h"
#include "ttsdf_localization/atlas/atlas_locator.h"
#include "ttsdf_localization/atlas/place_index_file.h"

namespace ttsdf::test {
namespace {

using ttsdf::testing::TempFolder;

constexpr double kRight = 0.03;              // [m]
const Eigen::Vector3d kDown(0.0, 1.0, 0.0);  // of the level camera below
const Eigen::Vector3d kTwin(30.0, 0.0, 0.0);

/// The first room of twoRooms(), with other furniture in the second one.
double otherRooms(const Eigen::Vector3d& at) {
  const Eigen::Vector3d p = at - kTwin;
  const double walls = std::min(p.minCoeff(), (Eigen::Vector3d(8.0, 3.0, 2.4) - p).minCoeff());
  return std::min({walls, boxSdf(p, {0.6, 0.4, 0.4}, {0.6, 0.4, 0.4}),
                   boxSdf(p, {3.9, 0.4, 1.2}, {0.1, 0.4, 1.2}), boxSdf(p, {1.8, 2.75, 0.5}, {0.5, 0.25, 0.5}),
                   boxSdf(p, {7.6, 1.5, 0.5}, {0.4, 0.9, 0.5}), boxSdf(p, {5.3, 0.3, 0.9}, {0.7, 0.3, 0.9})});
}

class Twins : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = new TempFolder;
    Atlas atlas;
    const Eigen::Isometry3d T_other = turnedBy(0.6, kTwin);
    atlas.maps = {store(partOf(twoRooms, {-0.3, -0.3, -0.3}, {8.3, 3.3, 2.7}, Eigen::Isometry3d::Identity()),
                        "one", Eigen::Isometry3d::Identity(), folder->path()),
                  store(partOf(otherRooms, {29.7, -0.3, -0.3}, {38.3, 3.3, 2.7}, T_other), "other", T_other,
                        folder->path())};
    writeAtlas(atlas, folder->path());
    AtlasLocator maker(folder->path(), atlas);
    maker.completeIndex();
    writePlaceIndex(maker.index(), folder->path());
  }
  static void TearDownTestSuite() { delete folder; }

  Twins() : atlas_(readAtlas(folder->path())) {}
  /// A level camera at a place of either building, which looks along `yaw`.
  static Eigen::Isometry3d camera(bool other, double x, double y, double yaw) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = Eigen::Vector3d(x, y, 1.3) + (other ? kTwin : Eigen::Vector3d::Zero());
    Eigen::Matrix3d level;
    level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    T.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix() * level;
    return T;
  }
  static ScanPoints seen(bool other, const Eigen::Isometry3d& T) {
    return castRays(other ? Sdf(otherRooms) : Sdf(twoRooms), T, wideDirections(), 0.005);
  }
  /// Looks round in the twin room, its back to the door.
  static std::vector<Eigen::Isometry3d> inTheTwinRoom(bool other) {
    return {camera(other, 3.0, 1.6, 2.9), camera(other, 2.5, 1.7, 3.1), camera(other, 2.1, 1.6, 3.4)};
  }
  static std::vector<Eigen::Isometry3d> inTheNextRoom(bool other) {
    return {camera(other, 4.6, 1.9, 0.0), camera(other, 5.1, 1.8, -0.3)};
  }
  /// An odometry that began somewhere else and drifts by 2 % of the way.
  AtlasLocation drive(const Eigen::Isometry3d& T_atlas_sensor, bool other, AtlasLocator& locator) {
    if (before_) {
      Eigen::Isometry3d step = before_->inverse() * T_atlas_sensor;
      step.translation() *= 1.02;
      T_odom_sensor_ = T_odom_sensor_ * step;
    }
    before_ = T_atlas_sensor;
    return locator.locateMoving(seen(other, T_atlas_sensor), kDown, T_odom_sensor_);
  }
  static bool names(const AtlasLocation& location, const Eigen::Isometry3d& T) {
    return std::any_of(
        location.candidates.begin(), location.candidates.end(),
        [&T](const AtlasCandidate& one) { return poseError(one.T_atlas_sensor, T).translation < kRight; });
  }
  static TempFolder* folder;
  Atlas atlas_;
  std::optional<Eigen::Isometry3d> before_;
  Eigen::Isometry3d T_odom_sensor_ = turnedBy(1.0, {4.0, -2.0, 0.5});
};
TempFolder* Twins::folder = nullptr;

TEST_F(Twins, AreDecidedByTheNextRoom) {
  for (const bool other : {false, true}) {
    AtlasLocator locator(folder->path(), atlas_);
    before_.reset();
    for (const Eigen::Isometry3d& T : inTheTwinRoom(other)) {
      const AtlasLocation found = drive(T, other, locator);
      EXPECT_FALSE(found.success);
      EXPECT_TRUE(names(found, T));
      Eigen::Isometry3d twin = T;
      twin.translation() += other ? Eigen::Vector3d(-kTwin) : kTwin;
      EXPECT_TRUE(names(found, twin));
    }
    EXPECT_EQ(locator.movingScans(), 3);
    AtlasLocation found;
    Eigen::Isometry3d truth;
    for (const Eigen::Isometry3d& T : inTheNextRoom(other)) {
      found = drive(T, other, locator);
      truth = T;
    }
    ASSERT_TRUE(found.success) << name(found.reason);
    EXPECT_LT(poseError(found.candidates.front().T_atlas_sensor, truth).translation, kRight);
    EXPECT_EQ(found.candidates.front().map, other ? "other" : "one");
  }
}

TEST_F(Twins, AreNotDecidedByARobotThatStands) {
  AtlasLocator locator(folder->path(), atlas_);
  const Eigen::Isometry3d T = inTheTwinRoom(true).front();
  AtlasLocation found;
  for (int n = 0; n < 5; ++n) found = drive(T, true, locator);
  EXPECT_EQ(locator.movingScans(), 1);
  EXPECT_FALSE(found.success);
  EXPECT_TRUE(names(found, T));
}

// What the first scan did not show is compared with it afterwards.
TEST_F(Twins, APlaceThatIsTriedLaterIsComparedWithTheScansBefore) {
  AtlasLocatorOptions options;
  options.moving.starts = options.moving.later_starts = 1;
  for (const bool other : {false, true}) {
    AtlasLocator locator(folder->path(), atlas_, options);
    before_.reset();
    const auto room = inTheTwinRoom(other);
    EXPECT_EQ(drive(room[0], other, locator).candidates.size(), 1u);
    drive(room[1], other, locator);
    const AtlasLocation both = drive(room[2], other, locator);
    EXPECT_FALSE(both.success);
    EXPECT_TRUE(names(both, room[2]));
    AtlasLocation found;
    for (const Eigen::Isometry3d& T : inTheNextRoom(other)) found = drive(T, other, locator);
    ASSERT_TRUE(found.success) << name(found.reason);
    EXPECT_LT(poseError(found.candidates.front().T_atlas_sensor, inTheNextRoom(other).back()).translation,
              kRight);
  }
}

// The next room of the other building, while the odometry says that the robot drove there from this one's.
TEST_F(Twins, ScansThatNoPlaceExplainsAreNotAccepted) {
  AtlasLocator locator(folder->path(), atlas_);
  for (const Eigen::Isometry3d& T : inTheTwinRoom(false)) drive(T, false, locator);
  Eigen::Isometry3d T_wrong = camera(false, 4.6, 1.9, 0.0);
  AtlasLocation found;
  for (int n = 0; n < 2; ++n) {
    // What it sees lies a metre and half a turn from where it drove.
    T_wrong.translation().x() += 0.4;
    const Eigen::Isometry3d step = before_->inverse() * T_wrong;
    T_odom_sensor_ = T_odom_sensor_ * step;
    before_ = T_wrong;
    found = locator.locateMoving(seen(true, camera(true, 5.8, 1.4, 2.0 + 0.4 * n)), kDown, T_odom_sensor_);
    EXPECT_FALSE(found.success);
  }
  locator.forgetScans();
  EXPECT_EQ(locator.movingScans(), 0);
}

TEST_F(Twins, FewPointsAndCancelledScansDoNotCount) {
  AtlasLocator locator(folder->path(), atlas_);
  const auto room = inTheTwinRoom(false);
  const AtlasLocation few = locator.locateMoving(ScanPoints::Ones(3, 10), kDown, room[0]);
  EXPECT_EQ(few.reason, TerminationReason::kTooFewPoints);
  EXPECT_EQ(locator.movingScans(), 0);
  ScanPoints none = seen(false, room[0]);
  none.setConstant(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(locator.locateMoving(none, kDown, room[0]).reason, TerminationReason::kTooFewPoints);
  locator.locateMoving(seen(false, room[0]), kDown, room[0]);
  const AtlasLocation cancelled =
      locator.locateMoving(seen(false, room[1]), kDown, room[1], [](double) { return false; });
  EXPECT_EQ(cancelled.reason, TerminationReason::kCancelled);
  EXPECT_EQ(locator.movingScans(), 1);
  EXPECT_TRUE(names(locator.locateMoving(seen(false, room[1]), kDown, room[1]), room[1]));
  EXPECT_EQ(locator.movingScans(), 2);
}

TEST_F(Twins, NothingIsAcceptedWhileAMapCannotBeRead) {
  TempFolder damaged;
  for (const char* file : {kAtlasFile, kPlaceIndexFile, "other.ttsdf"})
    std::filesystem::copy_file(folder->file(file), damaged.file(file));
  AtlasLocator locator(damaged.path(), atlas_);
  AtlasLocation found;
  for (const auto& room : {inTheTwinRoom(true), inTheNextRoom(true)}) {
    for (const Eigen::Isometry3d& T : room) {
      found = drive(T, true, locator);
      EXPECT_FALSE(found.success);
      EXPECT_TRUE(names(found, T));
    }
  }
  EXPECT_EQ(found.reason, TerminationReason::kUnsure);
}

TEST(MovingSearch, ChecksItsOptions) {
  for (const auto& spoil :
       {+[](MovingSearchOptions& o) { o.starts = 0; }, +[](MovingSearchOptions& o) { o.step = NAN; },
        +[](MovingSearchOptions& o) { o.lead = -0.1; },
        +[](MovingSearchOptions& o) { o.refuted = 0.5 * o.lead; }}) {
    MovingSearchOptions options;
    spoil(options);
    EXPECT_THROW(MovingSearch{options}, std::invalid_argument);
  }
}

}  // namespace
}  // namespace ttsdf::test

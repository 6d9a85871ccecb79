// Rooms that differ, and two that do not: which map a scan was taken in.

#include "ttsdf_localization/atlas/atlas_search.h"

#include <gtest/gtest.h>

#include "atlas_world.h"
#include "ttsdf_localization/field/long_range_field.h"

namespace ttsdf::test {
namespace {

using World = std::function<double(const Eigen::Vector3d&)>;

/// A room of another size with other furniture for every number.
World roomNumber(int n) {
  const double length = 3.4 + 0.45 * n, width = 4.6 - 0.3 * n, block = 0.4 + 0.15 * n;
  return [=](const Eigen::Vector3d& p) {
    const double walls = std::min(p.minCoeff(), (Eigen::Vector3d(length, width, 2.5) - p).minCoeff());
    return std::min({walls, boxSdf(p, {0.3, block, 0.5}, {0.3, block, 0.5}),
                     boxSdf(p, {length - 0.25, width - 0.6, 0.9}, {0.25, 0.6, 0.9}),
                     (p - Eigen::Vector3d(0.55 * length, 0.3 * width, 0.2)).norm() - 0.25 - 0.05 * n});
  };
}

constexpr int kRooms = 5;
constexpr double kPitch = 10.0;  // between the rooms [m]

class FiveRooms : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    for (int n = 0; n < kRooms; ++n) maps.push_back(placedRoom(n, kPitch * n, "room" + std::to_string(n)));
  }
  static PlacedField placedRoom(int room, double x, const std::string& name) {
    PlacedField map;
    map.name = name;
    map.T_atlas_map = turnedBy(0.4 * room, {x, 0.0, 0.0});
    const World world = roomNumber(room);
    TtSdfMap tt;
    tt.geometry.voxel_size = 0.05;
    tt.geometry.dims = Dims(125, 110, 62);
    tt.geometry.T_map_grid.translation().setConstant(-0.3);
    TtSvdOptions options;
    options.max_rank1 = options.max_rank2 = 30;
    tt.train = ttSvd(sampled(world, tt.geometry), options).train;
    tt.truncation = 0.15;
    map.field = makeField(tt);
    map.far = makeLongRangeField(*map.field);
    return map;
  }
  static PlaceIndex indexOf(const std::vector<PlacedField>& list) {
    PlaceIndex index;
    for (const PlacedField& map : list) index.add({map});
    return index;
  }
  static MapsAround from(const std::vector<PlacedField>& list) {
    return [&list](const std::string& name) {
      for (const PlacedField& map : list) {
        if (map.name == name) return std::vector<PlacedField>{map};
      }
      return std::vector<PlacedField>();
    };
  }
  /// Pose of a level camera in a room, and what it sees. Down is +y of the sensor.
  static Eigen::Isometry3d cameraIn(int room, int view) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() << 1.5 + 0.2 * (view % 3), 1.8 - 0.15 * (view % 2), 1.3;
    Eigen::Matrix3d level;
    level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    T.linear() = Eigen::AngleAxisd(1.1 * view + room, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
                 Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()).toRotationMatrix() * level;
    return T;
  }
  static Eigen::Vector3d down(const Eigen::Isometry3d& T_map_sensor) {
    return T_map_sensor.linear().transpose() * -Eigen::Vector3d::UnitZ();
  }
  struct Found {
    int right = 0, wrong = 0;
  };
  /// Ten scans, two in each room, without a prior: how many are accepted, within 5 cm and elsewhere.
  static Found tenScans(const std::vector<Eigen::Vector3d>& directions, const AtlasSearchOptions& options) {
    const PlaceIndex index = indexOf(maps);
    Found count;
    for (int n = 0; n < 10; ++n) {
      const int room = n % kRooms;
      const auto T = cameraIn(room, n + 3);
      const auto scan = castRays(roomNumber(room), T, directions, 0.005);
      const AtlasLocation found = locateInAtlas(index, from(maps), scan, down(T), options);
      if (!found.success) continue;
      const Eigen::Isometry3d truth = maps[static_cast<std::size_t>(room)].T_atlas_map * T;
      ++(poseError(truth, found.candidates[0].T_atlas_sensor).translation < 0.05 ? count.right : count.wrong);
    }
    return count;
  }
  static std::vector<PlacedField> maps;
};
std::vector<PlacedField> FiveRooms::maps;

TEST_F(FiveRooms, TheIndexRanksTheRightMapAmongTheFirst) {
  const PlaceIndex index = indexOf(maps);
  int first = 0, among_three = 0, scans = 0;
  double worst = 0.0;
  for (int room = 0; room < kRooms; ++room) {
    for (int view = 0; view < 8; ++view) {
      const auto T = cameraIn(room, view);
      const auto ranked = index.rank(castRays(roomNumber(room), T, wideDirections(), 0.005), down(T));
      ++scans;
      for (const auto& one : ranked) {
        if (one.map == maps[static_cast<std::size_t>(room)].name) worst = std::max(worst, one.difference);
      }
      for (std::size_t n = 0; n < 3; ++n) {
        if (ranked[n].map != maps[static_cast<std::size_t>(room)].name) continue;
        first += n == 0 ? 1 : 0;
        ++among_three;
      }
    }
  }
  RecordProperty("first_of_40", first);
  RecordProperty("worst_difference_of_the_right_map_percent", static_cast<int>(100.0 * worst));
  EXPECT_LT(worst, AtlasSearchOptions().excluded_difference);
  RecordProperty("among_three_of_40", among_three);
  RecordProperty("places", static_cast<int>(index.placeCount()));
  EXPECT_GE(among_three, scans * 3 / 4);
  EXPECT_LE(index.memoryBytes(), 300 * index.placeCount());
}

// From a pose that the index proposes, registration has to reach the right one.
TEST_F(FiveRooms, TheIndexProposesPosesNearTheRightOne) {
  const PlaceIndex index = indexOf(maps);
  int near = 0;
  for (int n = 0; n < 20; ++n) {
    const int room = n % kRooms;
    const auto T = cameraIn(room, n + 3);
    const PlacedField& map = maps[static_cast<std::size_t>(room)];
    const auto poses = index.hypotheses(castRays(roomNumber(room), T, wideDirections(), 0.005), down(T));
    for (std::size_t k = 0; k < std::min<std::size_t>(100, poses.size()); ++k) {
      if (poses[k].map != map.name) continue;
      OrientedBox box;  // of the field's grid
      box.T_atlas_box = map.T_atlas_map * map.field->geometry().T_map_grid;
      box.T_atlas_box.pretranslate(map.T_atlas_map.linear() * map.field->geometry().origin);
      const PoseError apart = poseError(map.T_atlas_map * T, poses[k].poseIn(box));
      if (apart.translation > 0.4 || apart.rotation > 0.2) continue;
      ++near;
      break;
    }
  }
  RecordProperty("near_of_20", near);
  EXPECT_GE(near, 15);
}

// One map is searched at the most, and all are told apart: poses of the index need no search.
TEST_F(FiveRooms, ScansAreFoundWithoutSearchingTheMaps) {
  AtlasSearchOptions options;
  options.max_maps = 1, options.excluded_difference = 1.1;  // none is excluded
  const Found found = tenScans(wideDirections(), options);
  RecordProperty("right_of_10", found.right);
  EXPECT_EQ(found.wrong, 0);
  EXPECT_GE(found.right, 3);
}

TEST_F(FiveRooms, ScansAreFoundInTheirMap) {
  AtlasSearchOptions options;
  options.max_maps = kRooms;
  const Found found = tenScans(wideDirections(), options);
  RecordProperty("right_of_10", found.right);
  EXPECT_EQ(found.wrong, 0);
  EXPECT_GE(found.right, 7);
}

// A corner is a corner: nothing is accepted that is not right.
TEST_F(FiveRooms, NarrowScansAreNeverAcceptedWrongly) {
  AtlasSearchOptions options;
  options.max_maps = kRooms;
  const Found found = tenScans(cameraDirections(60, 45), options);
  RecordProperty("narrow_right_of_10", found.right);
  EXPECT_EQ(found.wrong, 0);
}

// The map that the index likes best need not be the right one.
TEST_F(FiveRooms, MapsNotSearchedCount) {
  const PlaceIndex index = indexOf(maps);
  for (int n = 0; n < 10; ++n) {
    const int room = n % kRooms;
    const auto T = cameraIn(room, n + 3);
    AtlasSearchOptions options;
    options.max_maps = 1;
    const auto found = locateInAtlas(
        index, from(maps), castRays(roomNumber(room), T, wideDirections(), 0.005), down(T), options);
    if (!found.success) continue;
    EXPECT_EQ(found.candidates[0].map, maps[static_cast<std::size_t>(room)].name) << n;
  }
}

TEST_F(FiveRooms, TwinsAreAmbiguous) {
  std::vector<PlacedField> hotel = maps;
  hotel.push_back(maps[2]);
  hotel.back().name = "twin";
  hotel.back().T_atlas_map.translation().x() += 100.0;
  const PlaceIndex index = indexOf(hotel);
  const auto T = cameraIn(2, 4);
  const auto found =
      locateInAtlas(index, from(hotel), castRays(roomNumber(2), T, wideDirections(), 0.005), down(T));
  EXPECT_EQ(found.reason, TerminationReason::kAmbiguous);
  EXPECT_FALSE(found.success);
  ASSERT_GE(found.candidates.size(), 2u);
  EXPECT_NEAR(std::abs(found.candidates[0].T_atlas_sensor.translation().x() -
                       found.candidates[1].T_atlas_sensor.translation().x()),
              100.0, 0.1);
}

TEST_F(FiveRooms, NothingIsFoundWithoutPointsOrMaps) {
  const ScanPoints nothing(3, 0);
  EXPECT_FALSE(locateInAtlas(PlaceIndex(), from(maps), nothing, Eigen::Vector3d(0, 0, -1)).success);
  EXPECT_FALSE(locateInAtlas(indexOf({maps[0]}), from(maps), nothing, Eigen::Vector3d(0, 0, -1)).success);
  int asked = 0;
  const auto T = cameraIn(0, 1);
  const auto scan = castRays(roomNumber(0), T, cameraDirections(30, 20));
  const auto stopped =
      locateInAtlas(indexOf({maps[0]}), from(maps), scan, down(T), {}, [&](double) { return ++asked < 2; });
  EXPECT_EQ(stopped.reason, TerminationReason::kCancelled);
}

TEST(PlaceRanges, AreThoseOfTheDirections) {
  // A ball around the sensor: one range everywhere, however the sensor is turned.
  Eigen::Matrix3Xf points(3, 4000);
  const auto rays = directions(4000);
  for (std::size_t n = 0; n < rays.size(); ++n)
    points.col(static_cast<Eigen::Index>(n)) = (2.0 * rays[n]).cast<float>();
  const PlaceRanges ranges = rangesOfScan(points, Eigen::Vector3d(0.6, 0.0, -0.8));
  for (const std::uint8_t range : ranges) EXPECT_NEAR(range * kPlaceRangeStep, 2.0, kPlaceRangeStep);
  EXPECT_EQ(placeDifference(ranges, ranges), 0.0);
}

}  // namespace
}  // namespace ttsdf::test

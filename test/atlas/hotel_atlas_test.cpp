// A hotel of three storeys with twin rooms as an atlas: a drive through all of it, and where a scan without a
// prior was taken.

#include <gtest/gtest.h>

#include "atlas_world.h"
#include "ttsdf_localization/atlas/atlas_loader.h"
#include "ttsdf_localization/atlas/atlas_locator.h"
#include "ttsdf_localization/localization/localizer.h"
#include "ttsdf_localization/simulation/depth_camera.h"
#include "ttsdf_localization/simulation/hotel.h"
#include "ttsdf_localization/simulation/scene_sampling.h"
#include "ttsdf_localization/simulation/simulated_rig.h"

namespace ttsdf::test {
namespace {

using ttsdf::testing::TempFolder;

constexpr double kVoxel = 0.08, kAround = 0.6;  // of a map, and beyond its room's walls [m]
constexpr double kRight = 0.05;                 // [m]

class HotelAtlas : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    HotelOptions options;
    options.storeys = 3, options.rooms_per_side = 2, options.twin_share = 0.4;
    hotel = new Hotel(makeHotel(options));
    folder = new TempFolder;
    atlas = new Atlas;
    std::vector<Eigen::AlignedBox3d> corridors(hotel->tours.size());
    for (std::size_t n = 0; n < hotel->rooms.size(); ++n) {
      const HotelRoom& room = hotel->rooms[n];
      add(room.inside, "room" + std::to_string(n));
      const Eigen::Vector3d low(room.inside.min().x(), -1.0, room.inside.min().z()),
          high(room.inside.max().x(), 1.0, room.inside.max().z());
      corridors[static_cast<std::size_t>(room.storey)].extend(low).extend(high);
    }
    for (std::size_t n = 0; n < corridors.size(); ++n) add(corridors[n], "corridor" + std::to_string(n));
  }
  static void TearDownTestSuite() { delete atlas, delete folder, delete hotel; }

  static void add(Eigen::AlignedBox3d box, const std::string& name) {
    box.min().array() -= kAround, box.max().array() += kAround;
    TtSdfMap map;
    map.geometry = gridOver(box, kVoxel);
    DenseTensor values = sampleDistances(hotel->scene, map.geometry);
    for (std::size_t n = 0; n < values.size(); ++n)
      values.data()[n] = std::clamp(values.data()[n], -0.15F, 0.4F);
    TtSvdOptions options;
    options.max_rank1 = options.max_rank2 = 40;
    map.train = ttSvd(values, options).train;
    map.truncation = 0.15, map.clamp_negative = 0.15, map.clamp_positive = 0.4;
    atlas->maps.push_back(store(map, name, Eigen::Isometry3d::Identity(), folder->path()));
  }
  static DepthCamera camera(double degrees) {
    DepthCameraOptions options;
    options.width = 80, options.height = 60;
    options.fx = options.fy = 40.0 / std::tan(0.5 * degrees * M_PI / 180.0);
    return DepthCamera(options);
  }
  static ScanPoints scanFrom(const DepthCamera& camera, const Eigen::Isometry3d& T) {
    return toPoints(camera.render(hotel->scene, T), camera.intrinsics(), 1, 0.2, 5.0);
  }
  /// A camera beside the door that looks into a room; twins are looked at from the same place.
  static Eigen::Isometry3d cameraIn(const HotelRoom& room, double turn) {
    const double in = room.north ? 1.0 : -1.0;
    const Eigen::Isometry3d T_map_base =
        turnedBy(in * (0.9 + turn), {room.door.x() + 0.1, room.door.y() + in, room.inside.min().z() + 1.3});
    return T_map_base * opticalMount({});
  }
  static std::size_t twinsOf(const HotelRoom& room) {
    return static_cast<std::size_t>(
        std::count_if(hotel->rooms.begin(), hotel->rooms.end(), [&room](const HotelRoom& other) {
          return other.design == room.design && other.north == room.north;
        }));
  }
  static Hotel* hotel;
  static TempFolder* folder;
  static Atlas* atlas;
};
Hotel* HotelAtlas::hotel = nullptr;
TempFolder* HotelAtlas::folder = nullptr;
Atlas* HotelAtlas::atlas = nullptr;

TEST_F(HotelAtlas, ADriveThroughAllRoomsOfAllStoreysIsNeverLost) {
  constexpr double kRate = 2.5;  // [1/s]
  const DepthCamera eye = camera(70.0);
  AtlasLoaderOptions options;
  options.map_megabytes = 2.0, options.memory_megabytes = 24.0;
  AtlasLoader loader(folder->path(), *atlas, options);
  LocalizerOptions localizer_options;
  localizer_options.recovery.allow_global = false;
  Localizer localizer(localizer_options);
  std::shared_ptr<const AtlasField> field;
  double stamp = 10.0;
  int scans = 0, posed = 0;
  for (const auto& tour : hotel->tours) {
    const auto poses = Trajectory(tour, false).sample(kRate);
    for (std::size_t n = 0; n < poses.size(); ++n) {
      const Eigen::Isometry3d& truth = poses[n].T_map_base;
      loader.want(truth.translation());
      ASSERT_TRUE(loader.waitUntilSettled(30.0));
      EXPECT_LE(loader.status().bytes, std::size_t{24} << 20);
      if (loader.field() != field) {
        field = loader.field();
        localizer.exchangeMap(
            Localizer::prepareWith(field, field->farField(), localizer_options.registration));
      }
      if (n == 0) {  // out of the lift
        PoseGuess guess;
        guess.T_map_base = truth;
        guess.covariance = 1e-3 * Matrix6d::Identity();
        localizer.setGuess(guess);
      }
      LocalizerScan scan;
      scan.stamp = stamp += 1.0 / kRate;
      scan.T_base_sensor = opticalMount({});
      scan.T_odom_base = poses.front().T_map_base.inverse() * truth;
      scan.points = scanFrom(eye, truth * scan.T_base_sensor);
      const LocalizationUpdate update = localizer.process(scan);
      ++scans;
      ASSERT_NE(localizer.state(), LocalizerState::kLost) << truth.translation().transpose();
      if (!update.pose_valid) continue;
      ++posed;
      EXPECT_LT(poseError(update.T_map_base, truth).translation, kRight) << truth.translation().transpose();
    }
  }
  RecordProperty("scans", scans);
  RecordProperty("posed", posed);
  EXPECT_GT(scans, 300);
  EXPECT_GT(posed, scans * 3 / 4);
}

TEST_F(HotelAtlas, TwinsAreNamedAndNothingIsAcceptedWrongly) {
  const DepthCamera eye = camera(110.0);
  AtlasLocatorOptions options;
  options.map_megabytes = 2.0, options.memory_megabytes = 100.0;
  AtlasLocator locator(folder->path(), *atlas, options);
  int right = 0, alone = 0, twins = 0, ambiguous = 0;
  for (std::size_t n = 0; n < hotel->rooms.size(); ++n) {
    const HotelRoom& room = hotel->rooms[n];
    const Eigen::Isometry3d T = cameraIn(room, 0.1);
    const Eigen::Vector3d down = T.linear().transpose() * -Eigen::Vector3d::UnitZ();
    const AtlasLocation found = locator.locate(scanFrom(eye, T), down);
    const double error =
        found.candidates.empty() ? INFINITY : poseError(found.candidates[0].T_atlas_sensor, T).translation;
    EXPECT_TRUE(!found.success || error < kRight) << "room " << n << ": " << error << " m";
    if (twinsOf(room) > 1) {
      ++twins;
      EXPECT_FALSE(found.success) << "room " << n;
      if (found.reason != TerminationReason::kAmbiguous) continue;
      ++ambiguous;
      EXPECT_GE(found.candidates.size(), 2u);
    } else {
      ++alone;
      right += found.success ? 1 : 0;
    }
  }
  RecordProperty("right", right);
  RecordProperty("rooms_without_twin", alone);
  RecordProperty("ambiguous", ambiguous);
  RecordProperty("twins", twins);
  EXPECT_GE(twins, 2);
  EXPECT_GE(ambiguous, 1);
  EXPECT_GE(2 * right, alone);
}

}  // namespace
}  // namespace ttsdf::test

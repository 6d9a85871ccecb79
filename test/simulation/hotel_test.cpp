#include "ttsdf_localization/simulation/hotel.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace ttsdf {
namespace {

std::vector<std::pair<const HotelRoom*, const HotelRoom*>> twinsOf(const Hotel& hotel) {
  std::vector<std::pair<const HotelRoom*, const HotelRoom*>> twins;
  for (const HotelRoom& a : hotel.rooms) {
    for (const HotelRoom& b : hotel.rooms) {
      if (&a < &b && a.design == b.design && a.north == b.north) twins.emplace_back(&a, &b);
    }
  }
  return twins;
}

/// Largest difference of the distances at equal places of two rooms, away from their doors.
double difference(const AnalyticScene& scene, const HotelRoom& a, const HotelRoom& b) {
  double largest = 0.0;
  const Eigen::Vector3d size = a.inside.sizes().cwiseMin(b.inside.sizes());
  for (double x = 0.1; x < size.x(); x += 0.23) {
    for (double y = 0.1; y < size.y(); y += 0.23) {
      for (double z = 0.1; z < size.z(); z += 0.23) {
        const Eigen::Vector3d p(x, y, z);
        const double here = scene.signedDistance(a.inside.min() + p),
                     there = scene.signedDistance(b.inside.min() + p);
        if (std::min(here, there) < 0.0) continue;  // in matter the depth in one solid counts
        largest = std::max(largest, std::abs(here - there));
      }
    }
  }
  return largest;
}

HotelOptions fiveAsideOnThree() {
  HotelOptions options;
  options.storeys = 3, options.rooms_per_side = 5, options.twin_share = 0.4;
  return options;
}

TEST(Hotel, HasTheRoomsThatWereAskedFor) {
  const Hotel hotel = makeHotel(fiveAsideOnThree());
  ASSERT_EQ(hotel.rooms.size(), 30u);
  ASSERT_EQ(hotel.tours.size(), 3u);
  for (const HotelRoom& a : hotel.rooms) {
    EXPECT_NEAR(a.inside.min().z(), a.storey * kHotelStorey, 1e-9);
    for (const HotelRoom& b : hotel.rooms) {
      EXPECT_TRUE(&a == &b || a.inside.intersection(b.inside).isEmpty());
    }
  }
}

TEST(Hotel, TwinsAreAlikeAndOthersAreNot) {
  const Hotel hotel = makeHotel(fiveAsideOnThree());
  const auto twins = twinsOf(hotel);
  ASSERT_GE(twins.size(), 2u);
  for (const auto& [a, b] : twins) EXPECT_LT(difference(hotel.scene, *a, *b), 0.2) << a->design;
  EXPECT_GT(difference(hotel.scene, hotel.rooms[0], hotel.rooms[1]), 0.3);
}

TEST(Hotel, FollowsItsSeed) {
  HotelOptions other = fiveAsideOnThree();
  other.seed = 2;
  const Hotel a = makeHotel(fiveAsideOnThree()), b = makeHotel(fiveAsideOnThree()), c = makeHotel(other);
  EXPECT_EQ(a.rooms.back().inside.max(), b.rooms.back().inside.max());
  EXPECT_NE(a.rooms.back().inside.max(), c.rooms.back().inside.max());
}

TEST(Hotel, ToursOfAllStoreysLeaveRoomForTheCamera) {
  for (const std::uint32_t seed : {1U, 2U}) {
    HotelOptions options = fiveAsideOnThree();
    options.seed = seed;
    const Hotel hotel = makeHotel(options);
    for (const auto& tour : hotel.tours) {
      for (const StampedPose& at : Trajectory(tour, false).sample(5.0))
        ASSERT_GT(hotel.scene.signedDistance(at.T_map_base.translation()), 0.15)
            << at.T_map_base.translation().transpose() << ", seed " << seed;
    }
  }
}

TEST(Hotel, RefusesWhatCannotBeBuilt) {
  HotelOptions options;
  options.storeys = 0;
  EXPECT_THROW(makeHotel(options), std::invalid_argument);
  options = HotelOptions();
  options.twin_share = 1.5;
  EXPECT_THROW(makeHotel(options), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf

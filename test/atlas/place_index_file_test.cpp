// The index of places as a file: what is read is what was written, and nothing else is taken.

#include "ttsdf_localization/atlas/place_index_file.h"

#include <gtest/gtest.h>

#include "atlas_world.h"

namespace ttsdf::test {
namespace {

using ttsdf::testing::TempFolder;

PlaceIndex::Entry entryNamed(const std::string& name, std::uint32_t key, std::size_t places) {
  PlaceIndex::Entry entry{name, key, {}};
  for (std::size_t n = 0; n < places; ++n) {
    PlaceRanges ranges;
    for (std::size_t k = 0; k < ranges.size(); ++k)
      ranges[k] = static_cast<std::uint8_t>(7 * n + 3 * k + key);
    entry.places.push_back({ranges, {static_cast<std::uint16_t>(300 * n), 65535, 7}});
  }
  return entry;
}

PlaceIndex smallIndex() {
  PlaceIndex index;
  index.put(entryNamed("kitchen", 17, 3));
  index.put(entryNamed("hall", 18, 0));
  index.put(entryNamed("office", 0xfedcba98u, 1));
  return index;
}

TEST(PlaceIndexFile, GivesBackWhatWasWritten) {
  const PlaceIndex index = smallIndex();
  const PlaceIndex read = deserializePlaces(serialize(index));
  ASSERT_EQ(read.maps().size(), 3u);
  for (std::size_t n = 0; n < 3; ++n) {
    EXPECT_EQ(read.maps()[n].name, index.maps()[n].name);
    EXPECT_EQ(read.maps()[n].key, index.maps()[n].key);
    EXPECT_EQ(read.maps()[n].places, index.maps()[n].places);
  }
  EXPECT_EQ(serialize(read), serialize(index));
}

TEST(PlaceIndexFile, EveryDamagedByteAndEveryMissingEndIsNoticed) {
  const std::vector<std::uint8_t> bytes = serialize(smallIndex());
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    std::vector<std::uint8_t> damaged = bytes;
    damaged[n] ^= 0x40;
    EXPECT_THROW(deserializePlaces(damaged), std::runtime_error) << n;
    EXPECT_THROW(deserializePlaces({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n)}),
                 std::runtime_error)
        << n;
  }
}

AtlasMap mapAtX(const std::string& name, double x) {
  AtlasMap map;
  map.name = name;
  map.file = name + ".ttsdf";
  map.map_id = "0000000" + std::to_string(name.size());
  map.voxel_size = 0.05;
  map.size = Eigen::Vector3d(4.0, 4.0, 3.0);
  map.T_atlas_map.translation().x() = x;
  return map;
}

TEST(PlaceIndexFile, KeysChangeWithAMapAndWithItsNeighbours) {
  Atlas atlas;
  atlas.maps = {mapAtX("a", 0.0), mapAtX("bb", 3.0), mapAtX("ccc", 20.0)};
  const auto before = placeKeys(atlas);
  Atlas other = atlas;
  other.maps[0].map_id = "12345678";
  auto after = placeKeys(other);
  EXPECT_NE(after[0], before[0]);
  EXPECT_NE(after[1], before[1]);  // its places see into the first one
  EXPECT_EQ(after[2], before[2]);
  other = atlas;
  other.maps[2].T_atlas_map.translation().x() = 5.0;
  after = placeKeys(other);
  EXPECT_EQ(after[0], before[0]);
  EXPECT_NE(after[1], before[1]);
  EXPECT_NE(after[2], before[2]);
}

TEST(PlaceIndexFile, OnlyEntriesThatFitTheAtlasAreRead) {
  const TempFolder folder;
  Atlas atlas;
  atlas.maps = {mapAtX("a", 0.0), mapAtX("bb", 3.0), mapAtX("ccc", 20.0)};
  EXPECT_TRUE(readPlaceIndex(folder.path(), atlas).maps().empty());  // no file yet
  const auto keys = placeKeys(atlas);
  PlaceIndex index;
  for (std::size_t n = 0; n < 3; ++n) index.put(entryNamed(atlas.maps[n].name, keys[n], 1 + n));
  index.put(entryNamed("gone", 5, 2));
  writePlaceIndex(index, folder.path());
  EXPECT_EQ(readPlaceIndex(folder.path(), atlas).maps().size(), 3u);
  atlas.maps[0].map_id = "12345678";
  const PlaceIndex fitting = readPlaceIndex(folder.path(), atlas);
  ASSERT_EQ(fitting.maps().size(), 1u);
  EXPECT_EQ(fitting.maps()[0].name, "ccc");
  folder.write(kPlaceIndexFile, "nothing of the kind");
  EXPECT_THROW(readPlaceIndex(folder.path(), atlas), std::runtime_error);
}

TEST(PlaceIndexFile, ReplacesOneOfAnOlderVersionAndNoOtherFile) {
  const TempFolder folder;
  folder.write(kPlaceIndexFile, "TTSDFPL2 and its places");
  EXPECT_NO_THROW(writePlaceIndex(smallIndex(), folder.path()));
  folder.write(kPlaceIndexFile, "somebody's notes");
  EXPECT_THROW(writePlaceIndex(smallIndex(), folder.path()), std::runtime_error);
}

}  // namespace
}  // namespace ttsdf::test

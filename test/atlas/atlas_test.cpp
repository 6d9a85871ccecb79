#include "ttsdf_localization/atlas/atlas.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "atlas_world.h"

namespace ttsdf::test {
namespace {

using ttsdf::testing::fileContent;
using ttsdf::testing::TempFolder;
using ttsdf::testing::thrownMessage;

/// Two maps of two rooms that overlap by a metre, the second in a turned frame of its own.
class AtlasFolder : public ::testing::Test {
 protected:
  AtlasFolder() {
    const auto T_b = turnedBy(0.7, {3.0, 1.0, 0.2});
    const auto here = Eigen::Isometry3d::Identity();
    atlas_.maps.push_back(store(partOf(twoRooms, {-0.3, -0.3, -0.3}, {4.5, 3.3, 2.7}, here, 0.2), "left",
                                here, folder_.path()));
    atlas_.maps.push_back(
        store(partOf(twoRooms, {3.5, -0.3, -0.3}, {8.3, 3.3, 2.7}, T_b, 0.2), "right", T_b, folder_.path()));
    writeAtlas(atlas_, folder_.path());
  }
  std::string readingError() const {
    return thrownMessage<std::runtime_error>([this] { readAtlas(folder_.path()); });
  }
  /// Message after a part of atlas.yaml is replaced.
  std::string errorAfter(const std::string& from, const std::string& to) const {
    std::string text = toYaml(atlas_);
    const auto at = text.find(from);
    if (at == std::string::npos) return "the text has no " + from;
    folder_.write("atlas.yaml", text.replace(at, from.size(), to));
    return readingError();
  }
  TempFolder folder_;
  Atlas atlas_;
};

TEST_F(AtlasFolder, ReadsWhatWasWritten) {
  const Atlas read = readAtlas(folder_.path());
  ASSERT_EQ(read.maps.size(), 2u);
  EXPECT_EQ(toYaml(read), toYaml(atlas_));
  EXPECT_EQ(toYaml(readAtlas(folder_.file("atlas.yaml"))), toYaml(atlas_));
  EXPECT_TRUE(read.maps[1].T_atlas_map.isApprox(atlas_.maps[1].T_atlas_map, 1e-9));
  EXPECT_EQ(read.find("right")->map_id, atlas_.maps[1].map_id);
  EXPECT_EQ(read.find("middle"), nullptr);
  EXPECT_TRUE(problems(read, folder_.path()).empty());
}

TEST_F(AtlasFolder, NeighboursAreThoseThatOverlap) {
  EXPECT_EQ(atlas_.neighbours(), (std::vector<std::vector<std::size_t>>{{1}, {0}}));
  EXPECT_EQ(atlas_.neighbours(2.0), (std::vector<std::vector<std::size_t>>{{}, {}}));
}

TEST_F(AtlasFolder, SaysWhatIsWrongWithTheFile) {
  EXPECT_NE(errorAfter("atlas: 1", "atlas: 9").find("got version 9"), std::string::npos);
  EXPECT_NE(errorAfter("left.ttsdf", "../left.ttsdf").find("'..'"), std::string::npos);
  EXPECT_NE(errorAfter("left.ttsdf", "/etc/passwd").find("below the atlas' folder"), std::string::npos);
  EXPECT_NE(errorAfter("\"right\"", "\"left\"").find("two maps with the name 'left'"), std::string::npos);
  EXPECT_NE(errorAfter("right.ttsdf", "left.ttsdf").find("two maps with the file"), std::string::npos);
  EXPECT_NE(errorAfter("\"right\"", "\"a/b\"").find("letters, digits"), std::string::npos);
  EXPECT_NE(errorAfter("voxel_size: 0.2", "voxel_size: .nan").find("voxel size"), std::string::npos);
  EXPECT_NE(errorAfter("[0, 0, 0, 1]", "[0, 0, 0, 2]").find("quaternion of length 2"), std::string::npos);
  EXPECT_NE(errorAfter("[0, 0, 0, 1]", "[0, 0, 1]").find("got 3 numbers"), std::string::npos);
  EXPECT_NE(errorAfter("maps:", "rooms:").find("'maps'"), std::string::npos);
  EXPECT_NE(errorAfter(" id: \"", " id: \"x").find("8 hexadecimal digits"), std::string::npos);
  EXPECT_NE(errorAfter("atlas: 1", "atlas: *a").find("atlas.yaml"), std::string::npos);
  folder_.write("atlas.yaml", "- 1");
  EXPECT_NE(readingError().find("x_resolution"), std::string::npos);
  std::filesystem::remove(folder_.file("atlas.yaml"));
  EXPECT_NE(readingError().find("no such file"), std::string::npos);
}

TEST_F(AtlasFolder, KeepsItsLimits) {
  AtlasLimits limits;
  limits.max_maps = 1;
  EXPECT_THROW(readAtlas(folder_.path(), limits), std::runtime_error);
  limits = {};
  limits.max_file_bytes = 10;
  EXPECT_THROW(readAtlas(folder_.path(), limits), std::runtime_error);
}

// Its text takes 25 kB a map while it is parsed.
TEST_F(AtlasFolder, AListOfManyMapsTakesLittleMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
  GTEST_SKIP() << "freed memory is not given back";
#else
  constexpr std::size_t kMaps = 3000;
  for (AtlasMap map = atlas_.maps.front(); atlas_.maps.size() < kMaps;) {
    map.name = "m" + std::to_string(atlas_.maps.size());
    map.file = map.name + ".ttsdf";
    atlas_.maps.push_back(map);
  }
  writeAtlas(atlas_, folder_.path());
  const auto resident = [] {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages >> pages;
    return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  };
  const std::size_t before = resident();
  const Atlas read = readAtlas(folder_.path());
  ASSERT_EQ(read.maps.size(), kMaps);
  EXPECT_LT(resident(), before + kMaps * 4000);
#endif
}

TEST_F(AtlasFolder, NoLinkLeadsOut) {
  const TempFolder elsewhere;
  std::filesystem::rename(folder_.file("left.ttsdf"), elsewhere.file("left.ttsdf"));
  std::filesystem::create_symlink(elsewhere.file("left.ttsdf"), folder_.file("left.ttsdf"));
  EXPECT_THROW(mapPath(folder_.path(), atlas_.maps[0]), std::invalid_argument);
}

TEST_F(AtlasFolder, MayBeNamedByAWayUpAndDown) {
  const std::string inside = folder_.path() + "/inside";
  std::filesystem::create_directories(inside);
  EXPECT_TRUE(
      std::filesystem::equivalent(mapPath(inside + "/..", atlas_.maps[0]), folder_.file("left.ttsdf")));
  EXPECT_TRUE(problems(atlas_, inside + "/..").empty());
  AtlasMap out = atlas_.maps[0];
  out.file = "../left.ttsdf";
  EXPECT_THROW(mapPath(inside, out), std::invalid_argument);
}

TEST_F(AtlasFolder, ProblemsNameTheMap) {
  std::string bytes = fileContent(folder_.file("left.ttsdf"));
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  folder_.write("left.ttsdf", bytes);
  std::filesystem::remove(folder_.file("right.ttsdf"));
  atlas_.maps[1].T_atlas_map.translation().x() += 50.0;
  const auto lines = problems(atlas_, folder_.path());
  ASSERT_EQ(lines.size(), 4u);  // damaged, missing, and both alone
  EXPECT_EQ(lines[0].find("map 'left'"), 0u);
  EXPECT_NE(lines[1].find("cannot open"), std::string::npos) << lines[1];
  EXPECT_NE(lines[2].find("overlaps with no other map"), std::string::npos);
}

TEST_F(AtlasFolder, ReadsAutowaresGrid) {
  folder_.write("atlas.yaml", "x_resolution: 5.0\ny_resolution: 5.0\nleft.ttsdf: [0, 0]\n");
  const Atlas grid = readAtlas(folder_.path());
  ASSERT_EQ(grid.maps.size(), 1u);
  EXPECT_EQ(grid.maps[0].name, "left");
  EXPECT_TRUE(grid.maps[0].T_atlas_map.isApprox(Eigen::Isometry3d::Identity()));
  EXPECT_TRUE(grid.maps[0].size.isApprox(atlas_.maps[0].size));
  folder_.write("atlas.yaml", "x_resolution: 5.0\ny_resolution: 5.0\nleft.ttsdf: [100, 0]\n");
  EXPECT_NE(readingError().find("outside of the cell"), std::string::npos);
  folder_.write("atlas.yaml", "x_resolution: 5.0\ny_resolution: -1\n");
  EXPECT_NE(readingError().find("above 0"), std::string::npos);
  folder_.write("atlas.yaml", "x_resolution: 5.0\ny_resolution: 5.0\n../left.ttsdf: [0, 0]\n");
  EXPECT_NE(readingError().find("'..'"), std::string::npos);
}

}  // namespace
}  // namespace ttsdf::test

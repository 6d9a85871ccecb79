// ttsdf_atlas: an atlas of a simulated room, made, looked at and changed.
#include <gtest/gtest.h>
#include <json/value.h>

#include "frames_fixture.h"
#include "tool_process.h"
#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/atlas/place_index_file.h"
#include "ttsdf_localization/tools/json_file.h"

namespace ttsdf {
namespace {

namespace fs = std::filesystem;

class AtlasTool : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TestFolder;
    writeFrames(*folder_ / "frames", 24);
    first_ = build("atlas");
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static ToolRun build(const std::string& name, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{"build",
                                       *folder_ / name,
                                       "--frames",
                                       *folder_ / "frames",
                                       "--every",
                                       "2",
                                       "--voxel-size",
                                       "0.05",
                                       "--truncation",
                                       "0.15",
                                       "--max-depth",
                                       "5",
                                       "--max-rank",
                                       "20",
                                       "--refine-iterations",
                                       "4",
                                       "--size",
                                       "2.5",
                                       "--overlap",
                                       "0.8"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProcess("ttsdf_atlas", arguments);
  }
  static ToolRun run(const std::vector<std::string>& arguments) {
    return runProcess("ttsdf_atlas", arguments);
  }
  /// A copy of the atlas to change.
  static std::string copy(const std::string& name) {
    fs::copy(*folder_ / "atlas", *folder_ / name);
    return *folder_ / name;
  }
  static TestFolder* folder_;
  static ToolRun first_;
};
TestFolder* AtlasTool::folder_ = nullptr;
ToolRun AtlasTool::first_;

TEST_F(AtlasTool, BuildCutsTheFramesIntoMapsThatOverlap) {
  ASSERT_EQ(first_.exit_code, 0) << first_.err;
  const Atlas atlas = readAtlas(*folder_ / "atlas");
  EXPECT_GT(atlas.maps.size(), 1u);
  for (const auto& list : atlas.neighbours(0.5)) EXPECT_FALSE(list.empty());
  const ToolRun check = run({"check", *folder_ / "atlas"});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
}

TEST_F(AtlasTool, WorkersDoNotChangeTheResult) {
  ASSERT_EQ(build("again", {"--workers", "2"}).exit_code, 0);
  for (const char* file : {"/atlas.yaml", "/places.bin"})
    EXPECT_EQ(fileText(*folder_ / "again" + file), fileText(*folder_ / "atlas" + file));
}

// A folder in the place of the last map stops the build when the others are made.
TEST_F(AtlasTool, ABuildThatWasStoppedGoesOn) {
  const Atlas whole = readAtlas(*folder_ / "atlas");
  ASSERT_GE(whole.maps.size(), 3u);
  const std::string folder = *folder_ / "stopped", state = folder + "/unfinished_build.txt",
                    last = folder + "/" + whole.maps.back().file;
  fs::create_directories(last);
  const ToolRun stopped = build("stopped");
  ASSERT_EQ(stopped.exit_code, 1);
  EXPECT_NE(stopped.err.find(whole.maps.back().file), std::string::npos) << stopped.err;
  ASSERT_TRUE(fs::exists(state));
  EXPECT_FALSE(fs::exists(folder + "/atlas.yaml"));
  fs::remove(last);
  // One file was damaged since, and a line has no end.
  fs::resize_file(folder + "/" + whole.maps[0].file, 100);
  std::ofstream(state, std::ios::app) << "\n" << whole.maps[1].name << " 12";

  const ToolRun again = build("stopped");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.out.find(std::to_string(whole.maps.size() - 2) + " of them made by a build before"),
            std::string::npos)
      << again.out;
  for (const AtlasMap& map : whole.maps)
    EXPECT_EQ(fileText(folder + "/" + map.file), fileText(*folder_ / "atlas" + "/" + map.file)) << map.name;
  EXPECT_EQ(fileText(folder + "/atlas.yaml"), fileText(*folder_ / "atlas/atlas.yaml"));
  EXPECT_FALSE(fs::exists(state));
}

TEST_F(AtlasTool, OtherOptionsTakeNothingFromABuildThatWasStopped) {
  const Atlas whole = readAtlas(*folder_ / "atlas");
  const std::string folder = *folder_ / "other", last = folder + "/" + whole.maps.back().file;
  fs::create_directories(last);
  ASSERT_EQ(build("other").exit_code, 1);
  fs::remove(last);
  const ToolRun again = build("other", {"--min-surface", "0.5"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.out.find("made by a build before"), std::string::npos) << again.out;
}

TEST_F(AtlasTool, InfoListsMaps) {
  const ToolRun info = run({"info", *folder_ / "atlas", "--json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  const auto root = parseJson(info.out, "info");
  const Atlas atlas = readAtlas(*folder_ / "atlas");
  ASSERT_EQ(root["maps"].size(), atlas.maps.size());
  EXPECT_EQ(root["maps"][0]["id"].asString(), atlas.maps[0].map_id);
  EXPECT_NE(run({"info", *folder_ / "atlas"}).out.find(atlas.maps[0].name), std::string::npos);
}

TEST_F(AtlasTool, CheckFindsWhatIsDamaged) {
  const std::string folder = copy("damaged");
  const Atlas atlas = readAtlas(folder);
  fs::resize_file(fs::path(folder) / atlas.maps[0].file, 100);
  const ToolRun check = run({"check", folder});
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_NE(check.out.find("map '" + atlas.maps[0].name + "'"), std::string::npos) << check.out;
}

TEST_F(AtlasTool, MapsAreAddedReplacedAndRemoved) {
  const std::string folder = copy("changed");
  const Atlas before = readAtlas(folder);
  const std::string first = folder + "/" + before.maps[0].file, second = folder + "/" + before.maps[1].file;
  ASSERT_EQ(run({"add", folder, first, "--name", "twin", "--pose", "20,0,0,0,0,0.6,0.8"}).exit_code, 0);
  EXPECT_EQ(readAtlas(folder).find("twin")->T_atlas_map.translation().x(), 20.0);
  const ToolRun again = run({"add", folder, first, "--name", "twin"});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("--replace"), std::string::npos);
  ASSERT_EQ(run({"add", folder, second, "--name", "twin", "--replace"}).exit_code, 0);
  const Atlas replaced = readAtlas(folder);
  EXPECT_EQ(replaced.find("twin")->version, 2);
  EXPECT_EQ(replaced.find("twin")->map_id, before.maps[1].map_id);
  EXPECT_EQ(replaced.find("twin")->T_atlas_map.translation().x(), 20.0);
  ASSERT_EQ(run({"remove", folder, "twin"}).exit_code, 0);
  EXPECT_EQ(readAtlas(folder).maps.size(), before.maps.size());
  EXPECT_FALSE(fs::exists(folder + "/twin.ttsdf"));
  EXPECT_EQ(run({"remove", folder, "twin"}).exit_code, 1);
}

TEST_F(AtlasTool, AtlasesAreMerged) {
  const std::string folder = copy("merged");
  EXPECT_EQ(run({"merge", folder, *folder_ / "atlas"}).exit_code, 1);  // the same names
  ASSERT_EQ(run({"merge", folder, *folder_ / "atlas", "--prefix", "upper_", "--pose", "0,0,3"}).exit_code, 0);
  const Atlas atlas = readAtlas(folder), floor = readAtlas(*folder_ / "atlas");
  EXPECT_EQ(atlas.maps.size(), 2 * floor.maps.size());
  EXPECT_EQ(atlas.find("upper_" + floor.maps[0].name)->T_atlas_map.translation().z(), 3.0);
  EXPECT_EQ(run({"check", folder}).exit_code, 0);
}

TEST_F(AtlasTool, TheIndexOfPlacesFollowsTheMaps) {
  const std::string folder = copy("indexed");
  const Atlas atlas = readAtlas(folder);
  EXPECT_EQ(readPlaceIndex(folder, atlas).maps().size(), atlas.maps.size());  // build made it
  const std::string before = fileText(folder + "/places.bin");
  ASSERT_EQ(run({"index", folder}).exit_code, 0);
  EXPECT_EQ(fileText(folder + "/places.bin"), before);
  ASSERT_EQ(run({"remove", folder, atlas.maps[0].name}).exit_code, 0);
  const ToolRun index = run({"index", folder});
  ASSERT_EQ(index.exit_code, 0) << index.err;
  EXPECT_NE(index.out.find("places"), std::string::npos);
  const Atlas rest = readAtlas(folder);
  EXPECT_EQ(readPlaceIndex(folder, rest).maps().size(), rest.maps.size());
  fs::resize_file(fs::path(folder) / rest.maps[0].file, 100);
  fs::remove(folder + "/places.bin");
  const ToolRun damaged = run({"index", folder});
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_NE(damaged.err.find("map '" + rest.maps[0].name + "'"), std::string::npos) << damaged.err;
}

TEST_F(AtlasTool, TheSurfaceOfAllMapsIsOneMesh) {
  const ToolRun run_export = run({"export", *folder_ / "atlas", "--surface", *folder_ / "all.ply"});
  ASSERT_EQ(run_export.exit_code, 0) << run_export.err;
  EXPECT_GT(fs::file_size(*folder_ / "all.ply"), 10000u);
}

TEST_F(AtlasTool, SaysWhatIsWrong) {
  EXPECT_EQ(run({}).exit_code, 2);
  EXPECT_EQ(run({"fly"}).exit_code, 2);
  EXPECT_EQ(run({"--help"}).exit_code, 0);
  for (const char* command : {"build", "info", "check", "add", "remove", "merge", "index", "export"}) {
    const ToolRun help = run({command, "--help"});
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_NE(help.out.find(std::string("usage: ttsdf_atlas ") + command), std::string::npos);
  }
  EXPECT_EQ(build("atlas").exit_code, 1);  // there is one
  EXPECT_EQ(build("new", {"--overlap", "3"}).exit_code, 2);
  EXPECT_EQ(run({"export", *folder_ / "atlas"}).exit_code, 2);
  EXPECT_EQ(run({"info", *folder_ / "frames"}).exit_code, 1);
  EXPECT_EQ(run({"add", *folder_ / "atlas", *folder_ / "nothing.ttsdf", "--pose", "1,2"}).exit_code, 1);
}

}  // namespace
}  // namespace ttsdf

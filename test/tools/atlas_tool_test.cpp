// ttsdf_atlas: an atlas of a simulated room, looked at and changed.
#include <json/value.h>

#include "atlas_fixture.h"
#include "ttsdf_localization/atlas/place_index_file.h"
#include "ttsdf_localization/tools/json_file.h"

namespace ttsdf {
namespace {

namespace fs = std::filesystem;

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

TEST_F(AtlasTool, ADamagedMapIsReplacedAndRolledBack) {
  const std::string folder = copy("repaired");
  const Atlas before = readAtlas(folder);
  const std::string name(64, 'n');  // as long as names may be
  const auto add = [&](std::size_t map, bool replace) {
    std::vector<std::string> words{"add", folder, *folder_ / "atlas" + "/" + before.maps[map].file, "--name",
                                   name};
    if (replace) words.push_back("--replace");
    return run(words);
  };
  ASSERT_EQ(add(0, false).exit_code, 0);
  const ToolRun second = add(1, true);
  ASSERT_EQ(second.exit_code, 0) << second.err;
  EXPECT_EQ(second.err.find("not kept"), std::string::npos) << second.err;
  const std::string file = folder + "/" + readAtlas(folder).find(name)->file;
  fs::resize_file(file, 100);
  ASSERT_EQ(add(1, true).exit_code, 0);  // the same map again: the same version
  EXPECT_EQ(readAtlas(folder).find(name)->version, 2);
  EXPECT_EQ(fileContent(file), fileContent(*folder_ / "atlas" + "/" + before.maps[1].file));

  fs::remove(file);
  const ToolRun third = add(0, true);
  ASSERT_EQ(third.exit_code, 0) << third.err;
  EXPECT_NE(third.err.find("version 2 is not kept"), std::string::npos) << third.err;
  EXPECT_EQ(readAtlas(folder).find(name)->version, 3);
  EXPECT_EQ(run({"rollback", folder, name}).exit_code, 1);  // version 1 is what it is again
  fs::resize_file(file, 100);
  const ToolRun back = run({"rollback", folder, name});
  ASSERT_EQ(back.exit_code, 0) << back.err;
  EXPECT_EQ(fileContent(file), fileContent(*folder_ / "atlas" + "/" + before.maps[0].file));
  EXPECT_EQ(readAtlas(folder).find(name)->version, 3);
  ASSERT_EQ(run({"remove", folder, name}).exit_code, 0);
  EXPECT_FALSE(fs::exists(folder + "/versions/" + name));
}

// The file of the next version is there, atlas.yaml says the one before.
TEST_F(AtlasTool, AnInterruptedReplacementIsRolledBack) {
  const std::string folder = copy("interrupted");
  const Atlas before = readAtlas(folder);
  const AtlasMap& map = before.maps[0];
  const std::string yaml = fileContent(folder + "/atlas.yaml");
  ASSERT_EQ(
      run({"add", folder, folder + "/" + before.maps[1].file, "--name", map.name, "--replace"}).exit_code, 0);
  std::ofstream(folder + "/atlas.yaml") << yaml;
  EXPECT_EQ(run({"check", folder}).exit_code, 1);
  const ToolRun back = run({"rollback", folder, map.name});
  ASSERT_EQ(back.exit_code, 0) << back.err;
  EXPECT_EQ(fileContent(folder + "/" + map.file), fileContent(*folder_ / "atlas" + "/" + map.file));
  EXPECT_EQ(readAtlas(folder).find(map.name)->map_id, map.map_id);
  EXPECT_EQ(readAtlas(folder).find(map.name)->version, 1);
  EXPECT_EQ(run({"check", folder}).exit_code, 0);
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
  const std::string before = fileContent(folder + "/places.bin");
  ASSERT_EQ(run({"index", folder}).exit_code, 0);
  EXPECT_EQ(fileContent(folder + "/places.bin"), before);
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
  for (const char* command : {"build", "cell", "finish", "info", "check", "add", "remove", "update",
                              "rollback", "merge", "index", "export"}) {
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

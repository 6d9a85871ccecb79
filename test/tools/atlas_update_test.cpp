// ttsdf_atlas update and rollback: a room changes, its maps follow and go back.
#include <json/value.h>

#include <set>

#include "atlas_fixture.h"
#include "ttsdf_localization/atlas/place_index_file.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/simulation/scene_builder.h"
#include "ttsdf_localization/tools/json_file.h"

namespace ttsdf {
namespace {

namespace fs = std::filesystem;

class AtlasUpdate : public AtlasTool {
 protected:
  /// The room with one more thing in it, seen by frames that look towards one end of it.
  static void writeChangedFrames(const std::string& name, bool box) {
    AnalyticScene scene = makeRoom();
    if (box) {
      SceneBuilder b;
      b.boxAt(kBox, kSize);
      const AnalyticScene thing = b.build();
      for (const Solid& solid : thing.solids()) scene.add(solid);
    }
    writeFramesOf(scene, *folder_ / name, 12, -0.15, 0.15);
  }
  static ToolRun update(const std::string& folder, const std::string& frames, const std::string& every = "1",
                        const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"update",
                                   folder,
                                   "--frames",
                                   *folder_ / frames,
                                   "--every",
                                   every,
                                   "--max-depth",
                                   "5",
                                   "--refine-iterations",
                                   "4",
                                   "--report",
                                   *folder_ / "report.json"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }
  static double distanceAt(const std::string& folder, const AtlasMap& map, const Eigen::Vector3d& p) {
    const auto field = makeField(loadMap(mapPath(folder, map)));
    Eigen::Matrix3Xf points(3, 1);
    points.col(0) = (map.T_atlas_map.inverse() * p - field->geometry().origin).cast<float>();
    const FieldSamples samples = field->evaluate(points);
    return samples.states[0] == PointState::kValid ? static_cast<double>(samples.values[0]) : NAN;
  }
  static constexpr double kInside = 0.35;  // from the border of a map: beyond its margin [m]
  static constexpr Place kBox{3.1, 1.5, 0.0, 0.0};
  inline static const Eigen::Vector3d kSize{0.5, 0.6, 0.8};
};

TEST_F(AtlasUpdate, MapsThatFramesSeeFollowTheRoomAndGoBack) {
  const std::string folder = copy("living");
  const Atlas before = readAtlas(folder);
  writeChangedFrames("with_box", true);
  const ToolRun first = update(folder, "with_box");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const Atlas after = readAtlas(folder);
  const auto report = parseJson(fileContent(*folder_ / "report.json"), "report");

  // The top of the box, 0.8 m above the floor, was free and is a surface now.
  const Eigen::Vector3d top(kBox.x, kBox.y, 0.8);
  std::set<std::string> replaced;
  int holding = 0;
  for (std::size_t n = 0; n < after.maps.size(); ++n) {
    const bool changed = after.maps[n].map_id != before.maps[n].map_id;
    EXPECT_EQ(after.maps[n].version, changed ? 2 : 1);
    if (changed) replaced.insert(after.maps[n].name);
    if (after.maps[n].box().depth(top) < kInside) continue;
    ++holding;
    EXPECT_TRUE(changed) << after.maps[n].name;
    EXPECT_GT(distanceAt(*folder_ / "atlas", before.maps[n], top), 0.1);  // the fixture's atlas stays
    EXPECT_LT(std::abs(distanceAt(folder, after.maps[n], top)), 0.05);
  }
  EXPECT_GE(holding, 1);
  EXPECT_LT(replaced.size(), after.maps.size());  // the other end of the room was not seen
  for (const Json::Value& map : report["maps"]) {
    EXPECT_EQ(map["replaced"].asBool(), replaced.count(map["name"].asString()) != 0);
    const double shares = map["added"].asDouble() + map["removed"].asDouble() + map["moved"].asDouble() +
                          map["seen_first"].asDouble();
    EXPECT_TRUE(shares >= 0.005 || !map["replaced"].asBool()) << map["name"].asString();
  }
  EXPECT_EQ(run({"check", folder}).exit_code, 0);
  EXPECT_EQ(readPlaceIndex(folder, after).maps().size(), after.maps.size());

  // Back to what it was, and forth again.
  const std::string name = *replaced.begin();
  const ToolRun back = run({"rollback", folder, name});
  ASSERT_EQ(back.exit_code, 0) << back.err;
  EXPECT_EQ(readAtlas(folder).find(name)->map_id, before.find(name)->map_id);
  EXPECT_EQ(readAtlas(folder).find(name)->version, 3);
  EXPECT_EQ(fileContent(folder + "/" + before.find(name)->file),
            fileContent(*folder_ / "atlas" + "/" + before.find(name)->file));
  ASSERT_EQ(run({"rollback", folder, name, "--version", "2"}).exit_code, 0);
  EXPECT_EQ(readAtlas(folder).find(name)->map_id, after.find(name)->map_id);
  const ToolRun none = run({"rollback", folder, name, "--version", "9"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("wanted one that is kept (1, 2, 3)"), std::string::npos) << none.err;
  EXPECT_EQ(run({"check", folder}).exit_code, 0);

  // The box is carried away again.
  writeChangedFrames("without_box", false);
  ASSERT_EQ(update(folder, "without_box").exit_code, 0);
  const Atlas cleared = readAtlas(folder);
  for (const AtlasMap& map : cleared.maps) {
    if (map.box().depth(top) < kInside) continue;
    EXPECT_GT(distanceAt(folder, map, top), 0.1) << map.name;
  }
}

// They fill edges and smooth, though: maps change by more than the least that counts by default.
TEST_F(AtlasUpdate, FramesThatWereFusedBeforeRemoveAndAddNothing) {
  const std::string folder = copy("same");
  const std::string before = fileContent(folder + "/atlas.yaml");
  const ToolRun same = update(folder, "frames", "2", {"--min-change", "0.15"});  // that it was built from
  ASSERT_EQ(same.exit_code, 0) << same.err;
  const auto report = parseJson(fileContent(*folder_ / "report.json"), "report");
  EXPECT_EQ(report["maps"].size(), readAtlas(folder).maps.size());
  EXPECT_EQ(fileContent(folder + "/atlas.yaml"), before) << same.out;
  for (const Json::Value& map : report["maps"]) {
    EXPECT_FALSE(map["replaced"].asBool()) << map["name"].asString();
    EXPECT_LT(map["removed"].asDouble(), 0.03) << map["name"].asString();
    EXPECT_LT(map["added"].asDouble(), 0.03) << map["name"].asString();
  }
}

TEST_F(AtlasUpdate, ADamagedMapTakesNothingFromTheOthers) {
  const std::string folder = copy("one_damaged");
  writeChangedFrames("with_box_too", true);
  const Atlas before = readAtlas(folder);
  std::string damaged;  // one that the box is in
  for (const AtlasMap& map : before.maps) {
    if (map.box().depth(Eigen::Vector3d(kBox.x, kBox.y, 0.8)) > 0.0) damaged = map.name;
  }
  fs::resize_file(folder + "/" + before.find(damaged)->file, 100);
  const ToolRun one = update(folder, "with_box_too");
  EXPECT_EQ(one.exit_code, 1);
  EXPECT_NE(one.err.find("map '" + damaged + "'"), std::string::npos) << one.err;
  const auto report = parseJson(fileContent(*folder_ / "report.json"), "report");
  ASSERT_EQ(report["failed"].size(), 1u);
  EXPECT_EQ(report["failed"][0].asString(), damaged);
  EXPECT_GE(report["maps"].size(), 1u);
  const Atlas after = readAtlas(folder);
  const PlaceIndex index = readPlaceIndex(folder, after);  // of the maps as they are now
  EXPECT_EQ(index.maps().size(), after.maps.size() - 1);
}

TEST_F(AtlasUpdate, FramesThatCannotBeUsedAreSkipped) {
  const std::string folder = copy("skipping");
  const std::string frames = *folder_ / "bad";
  writeChangedFrames("bad", true);
  folder_->write("bad/frame-000001.pose.txt", "-inf 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  folder_->write("bad/frame-000003.pose.txt", "1 0 0 90000\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  fs::resize_file(frames + "/frame-000002.depth.png", 300);
  const ToolRun run = update(folder, "bad");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(parseJson(fileContent(*folder_ / "report.json"), "report")["skipped"].size(), 3u) << run.err;
  for (const char* name : {"frame-000001", "frame-000002", "frame-000003"})
    EXPECT_NE(run.err.find(name), std::string::npos) << run.err;
  EXPECT_NE(run.out.find("9 frames"), std::string::npos) << run.out;
}

TEST_F(AtlasUpdate, FramesThatContradictOneAnotherChangeNothing) {
  const std::string folder = copy("contradicting");
  const std::string before = fileContent(folder + "/atlas.yaml");
  const ToolRun wrong = AtlasTool::run(
      {"update", folder, "--frames", *folder_ / "frames", "--every", "1", "--poses", "world-to-camera"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_NE(wrong.err.find("--trust-frames"), std::string::npos) << wrong.err;
  EXPECT_EQ(fileContent(folder + "/atlas.yaml"), before);
}

TEST_F(AtlasUpdate, SaysWhatIsWrong) {
  const std::string folder = copy("wrong");
  EXPECT_EQ(run({"update", folder}).exit_code, 2);
  EXPECT_EQ(run({"update", folder, "--frames", *folder_ / "frames", "--voxel-size", "0.1"}).exit_code, 2);
  EXPECT_EQ(run({"update", folder, "--frames", *folder_ / "frames", "--camera-axes", "up"}).exit_code, 2);
  EXPECT_EQ(run({"update", folder, "--frames", *folder_ / "frames", "--report", "/nowhere/r"}).exit_code, 1);
  EXPECT_EQ(run({"update", folder, "--frames", *folder_ / "nowhere"}).exit_code, 1);
  const ToolRun first = run({"rollback", folder, readAtlas(folder).maps[0].name});
  EXPECT_EQ(first.exit_code, 1);
  EXPECT_NE(first.err.find("wanted one with an older version"), std::string::npos) << first.err;
  EXPECT_EQ(run({"rollback", folder, "nobody"}).exit_code, 1);
}

}  // namespace
}  // namespace ttsdf

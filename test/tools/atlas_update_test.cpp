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
  static ToolRun update(const std::string& folder, const std::string& frames,
                        const std::string& every = "1") {
    return run({"update", folder, "--frames", *folder_ / frames, "--every", every, "--max-depth", "5",
                "--refine-iterations", "4", "--report", *folder_ / "report.json"});
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
  const auto report = parseJson(fileText(*folder_ / "report.json"), "report");

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
  EXPECT_EQ(fileText(folder + "/" + before.find(name)->file),
            fileText(*folder_ / "atlas" + "/" + before.find(name)->file));
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

TEST_F(AtlasUpdate, FramesThatShowNothingNewChangeNothing) {
  const std::string folder = copy("same");
  const std::string before = fileText(folder + "/atlas.yaml");
  const ToolRun same = update(folder, "frames", "2");  // those that it was built from
  ASSERT_EQ(same.exit_code, 0) << same.err;
  const auto report = parseJson(fileText(*folder_ / "report.json"), "report");
  EXPECT_EQ(report["maps"].size(), readAtlas(folder).maps.size());
  for (const Json::Value& map : report["maps"]) {
    EXPECT_LT(map["removed"].asDouble(), 0.03) << map["name"].asString();
    EXPECT_LT(map["added"].asDouble(), 0.03) << map["name"].asString();
  }
}

TEST_F(AtlasUpdate, SaysWhatIsWrong) {
  const std::string folder = copy("wrong");
  EXPECT_EQ(run({"update", folder}).exit_code, 2);
  EXPECT_EQ(run({"update", folder, "--frames", *folder_ / "nowhere"}).exit_code, 1);
  const ToolRun first = run({"rollback", folder, readAtlas(folder).maps[0].name});
  EXPECT_EQ(first.exit_code, 1);
  EXPECT_NE(first.err.find("wanted one with an older version"), std::string::npos) << first.err;
  EXPECT_EQ(run({"rollback", folder, "nobody"}).exit_code, 1);
}

}  // namespace
}  // namespace ttsdf

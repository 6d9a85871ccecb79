// One scan in every format and type of coordinate: the same pose, or a refusal.
#include <gtest/gtest.h>

#include <sstream>

#include "box_room.h"
#include "tool_process.h"
#include "ttsdf_localization/frames/frame_folder.h"

namespace ttsdf {
namespace {

template <class T>
std::string raw(const ScanPoints& points, double scale = 1.0) {
  std::string text;
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const auto value = static_cast<T>(scale * static_cast<double>(points(axis, n)));
      text.append(reinterpret_cast<const char*>(&value), sizeof(value));
    }
  }
  return text;
}

std::string ply(const std::string& type, const std::string& data, Eigen::Index count) {
  return "ply\nformat binary_little_endian 1.0\ncomment Created by Open3D\nelement vertex " +
         std::to_string(count) + "\nproperty " + type + " x\nproperty " + type + " y\nproperty " + type +
         " z\nend_header\n" + data;
}

std::string pcd(const std::string& size, const std::string& type, const std::string& data,
                Eigen::Index count) {
  const std::string n = std::to_string(count);
  return "VERSION 0.7\nFIELDS x y z\nSIZE " + size + "\nTYPE " + type + "\nCOUNT 1 1 1\nWIDTH " + n +
         "\nHEIGHT 1\nPOINTS " + n + "\nDATA binary\n" + data;
}

TEST(RegisterFormats, EveryTypeGivesThePoseOrARefusal) {
  const TempFolder folder;
  saveMap(roomMap(), folder / "room.ttsdf");
  const auto T_map_sensor = roomSensorPose();
  const ScanPoints points = roomScan(T_map_sensor, 1500);
  Eigen::Isometry3d T_prior = T_map_sensor;
  T_prior.translate(Eigen::Vector3d(0.04, -0.05, 0.03));
  writePose(folder / "the truth.txt", T_map_sensor);
  writePose(folder / "the prior.txt", T_prior);
  std::ostringstream text;
  text.precision(9);
  text << points.transpose() << '\n';
  const std::vector<std::pair<std::string, std::string>> good{
      {"f32.bin", raw<float>(points)},
      {"f64.bin", raw<double>(points)},
      {"float 32.ply", ply("float", raw<float>(points), points.cols())},
      {"open 3d.ply", ply("double", raw<double>(points), points.cols())},
      {"float.pcd", pcd("4 4 4", "F F F", raw<float>(points), points.cols())},
      {"double.pcd", pcd("8 8 8", "F F F", raw<double>(points), points.cols())},
      {"text.xyz", text.str()}};
  const std::vector<std::pair<std::string, std::string>> refused{
      {"int16.pcd", pcd("2 2 2", "I I I", raw<std::int16_t>(points, 1000.0), points.cols())},
      {"uchar.ply", ply("uchar", raw<std::uint8_t>(points, 10.0), points.cols())},
      {"same.pcd", pcd("4 4 4", "F F F", raw<float>(points.col(3).replicate(1, 2000)), 2000)}};
  std::string list;
  for (const auto* files : {&good, &refused}) {
    for (const auto& [name, content] : *files) {
      folder.write(name, content);
      list += "\"" + name + "\" \"the prior.txt\" \"the truth.txt\"\n";
    }
  }
  const ToolRun run =
      runProcess("ttsdf_register", {"--map", folder / "room.ttsdf", "--batch", folder.write("list.txt", list),
                                    "--output", folder / "out.csv"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("2 of 10 entries"), std::string::npos) << run.err;
  const auto lines = linesOf(fileContent(folder / "out.csv"));
  ASSERT_EQ(lines.size(), 1 + good.size() + refused.size());
  for (std::size_t n = 0; n < good.size(); ++n) {
    const auto cells = cellsOf(lines[n + 1]);
    EXPECT_EQ(cells.at(3), "1") << lines[n + 1];
    EXPECT_LT(std::stod(cells.at(16)), 0.01) << lines[n + 1];
  }
  for (std::size_t n = 0; n < refused.size(); ++n)
    EXPECT_EQ(cellsOf(lines[good.size() + n + 1]).at(3), "0") << lines[good.size() + n + 1];
}

}  // namespace
}  // namespace ttsdf

// doc/mistakes.md: common mistakes with the message that each gets, printed by running the tools on them.
// Written anew with TTSDF_UPDATE_CONFIG=1.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iomanip>
#include <limits>

#include "../support/rendered_scene.h"
#include "../tools/tool_process.h"

namespace ttsdf {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

/// The folder that all mistakes are made in, with good files to spoil.
class Workshop {
 public:
  Workshop() {
    fs::create_directories(folder_ / "frames");
    for (int n = 0; n < kFrames; ++n) writeFrame("frames", n, poseOf(n), 1000.0);
    folder_.write("frames/camera-intrinsics.txt", kIntrinsics);
    folder_.write("box.ply", box());
    folder_.write("identity.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    folder_.write("scan.xyz", "1 0 0\n0 1 0\n0 0 1\n");
    good_ = runProcess("ttsdf_build", {"--mesh", folder_ / "box.ply", "--voxel-size", "0.1", "--truncation",
                                       "0.3", "--output", folder_ / "box.ttsdf"});
  }
  const ToolRun& good() const { return good_; }
  std::string operator/(const std::string& name) const { return folder_ / name; }
  std::string write(const std::string& name, const std::string& text) const {
    return folder_.write(name, text);
  }

  static std::string box(double scale = 1.0) {
    std::ostringstream out;
    out << "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
    for (int n = 0; n < 8; ++n) {
      out << scale * ((n & 4) != 0 ? 1.0 : -1.0) << ' ' << scale * ((n & 2) != 0 ? 0.75 : -0.75) << ' '
          << scale * ((n & 1) != 0 ? 0.5 : -0.5) << '\n';
    }
    return out.str() +
           "3 0 1 3\n3 0 3 2\n3 4 6 7\n3 4 7 5\n3 0 4 5\n3 0 5 1\n3 2 3 7\n3 2 7 6\n3 0 2 6\n3 0 6 4\n3 1 5 "
           "7\n3 1 7 3\n";
  }
  static Eigen::Isometry3d poseOf(int n) {
    const double angle = 2.0 * 3.14159265358979 * n / kFrames;
    return testing::lookAt({2.0 + 0.8 * std::cos(angle), 1.5 + 0.5 * std::sin(angle), 1.2},
                           {2.0 + 3.0 * std::cos(angle + 2.2), 1.5 + 3.0 * std::sin(angle + 2.2), 0.9});
  }
  void writeFrame(const std::string& folder, int n, const Eigen::Isometry3d& pose, double units,
                  int width = 64) const {
    fs::create_directories(folder_ / folder);
    const CameraIntrinsics k = testing::camera(width, 3 * width / 4);
    static const testing::Scene kRoom =
        testing::Scene().room({0, 0, 0}, {4, 3, 2.5}).box({1.0, 0.2, 0.0}, {1.6, 0.8, 0.9});
    const DepthImage image = testing::render(kRoom, k, poseOf(n));
    std::ostringstream name, pgm, text;
    name << folder << "/frame-" << std::setw(6) << std::setfill('0') << n;
    pgm << "P5\n" << k.width << ' ' << k.height << "\n65535\n";
    for (const float z : image.depth) {
      const auto raw = static_cast<unsigned>(std::lround(static_cast<double>(z) * units));
      pgm.put(static_cast<char>(raw >> 8 & 255u)).put(static_cast<char>(raw & 255u));
    }
    text << std::setprecision(17) << pose.matrix() << '\n';
    folder_.write(name.str() + ".depth.pgm", pgm.str());
    folder_.write(name.str() + ".pose.txt", text.str());
  }
  /// A folder of frames with other poses or units.
  std::string frames(const std::string& name, const std::function<Eigen::Isometry3d(Eigen::Isometry3d)>& pose,
                     double units = 1000.0) const {
    for (int n = 0; n < kFrames; ++n) writeFrame(name, n, pose(poseOf(n)), units);
    folder_.write(name + "/camera-intrinsics.txt", kIntrinsics);
    return folder_ / name;
  }
  static constexpr int kFrames = 12;
  static constexpr char kIntrinsics[] = "57.6 0 31.5\n0 57.6 23.5\n0 0 1\n";

 private:
  TestFolder folder_;
  ToolRun good_;
};

struct Mistake {
  std::string what;  ///< what somebody did
  std::string tool;
  std::function<Words(const Workshop&)> arguments;
  std::string holds;  ///< the message must say this
  int exit_code = 1;
};

Words mesh(const Workshop& w, const std::string& name, const std::string& content, const Words& more = {}) {
  Words words{"--mesh", w.write(name, content), "--output", w / "out.ttsdf", "--voxel-size",
              "0.1",    "--truncation",         "0.3"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}
Words frames(const Workshop& w, const std::string& folder, const Words& more = {}) {
  Words words{"--frames", folder,         "--output", w / "out.ttsdf", "--every",
              "1",        "--voxel-size", "0.1",      "--truncation",  "0.3"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}
Words scan(const Workshop& w, const std::string& name, const std::string& content) {
  w.write(name, content);
  return {"--map",    w / "box.ttsdf",
          "--batch",  w.write("list.txt", "\"" + (w / name) + "\" \"" + (w / "identity.txt") + "\"\n"),
          "--output", w / "out.csv"};
}
std::string withoutFaces(std::string text) {
  text.replace(text.find("element face 12\nproperty list uchar int vertex_indices\n"), 55, "");
  return text.substr(0, text.find("\n3 0 1 3\n") + 1);
}
std::string pcd(const std::string& size, const std::string& type, const std::string& points,
                const std::string& data) {
  return "VERSION 0.7\nFIELDS x y z\nSIZE " + size + "\nTYPE " + type + "\nCOUNT 1 1 1\nWIDTH " + points +
         "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + points + "\nDATA " + data;
}

std::vector<Mistake> mistakes() {
  using W = const Workshop&;
  const std::string build = "ttsdf_build", reg = "ttsdf_register";
  std::vector<Mistake> m;
  // meshes
  m.push_back({"A mesh whose name is misspelt", build,
               [](W w) {
                 return Words{"--mesh", w / "absent.ply", "--output", w / "o"};
               },
               "no such file"});
  m.push_back({"A folder in a mesh's place", build,
               [](W w) {
                 return Words{"--mesh", w / "frames", "--output", w / "o"};
               },
               "wanted"});
  m.push_back({"An empty mesh file", build, [](W w) { return mesh(w, "a.ply", ""); }, "empty"});
  m.push_back({"A mesh that Git LFS has not fetched", build,
               [](W w) { return mesh(w, "a.ply", "version https://git-lfs.github.com/spec/v1\n"); },
               "git lfs pull"});
  m.push_back({"A web page saved as a mesh", build,
               [](W w) { return mesh(w, "a.ply", "<!DOCTYPE html><html></html>"); }, "web page"});
  m.push_back({"A mesh still zipped", build, [](W w) { return mesh(w, "a.ply", std::string("PK\3\4....")); },
               "unpacked"});
  m.push_back(
      {"A format that is none of a mesh", build, [](W w) { return mesh(w, "a.docx", "text"); }, ".ply"});
  m.push_back({"A text called .ply", build, [](W w) { return mesh(w, "a.ply", "hello\n"); }, "PLY header"});
  m.push_back({"A PLY cut off by a broken download", build,
               [](W w) { return mesh(w, "a.ply", Workshop::box().substr(0, 300)); }, "truncated"});
  m.push_back({"A PLY that promises more vertices than it has", build,
               [](W w) {
                 std::string t = Workshop::box();
                 t.replace(t.find("vertex 8"), 8, "vertex 800000");
                 return mesh(w, "a.ply", t);
               },
               "promises"});
  m.push_back({"A PLY with more data than its header says", build,
               [](W w) { return mesh(w, "a.ply", Workshop::box() + "3 0 1 2\n"); }, "more data"});
  m.push_back({"A point cloud as a mesh", build,
               [](W w) { return mesh(w, "a.ply", withoutFaces(Workshop::box())); }, "--cloud"});
  m.push_back({"A face with vertex -1", build,
               [](W w) { return mesh(w, "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"); },
               "vertex index -1"});
  m.push_back({"A face with a vertex that is not there", build,
               [](W w) { return mesh(w, "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"); }, "vertex index"});
  m.push_back({"An OBJ whose indices begin at 0", build,
               [](W w) { return mesh(w, "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"); }, "indices"});
  m.push_back({"A vertex that is NaN", build,
               [](W w) { return mesh(w, "a.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n"); }, "not finite"});
  m.push_back({"An OFF without its faces", build,
               [](W w) { return mesh(w, "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n"); }, "truncated"});
  m.push_back({"A binary STL cut off", build,
               [](W w) { return mesh(w, "a.stl", std::string(80, 'x') + std::string("\5\0\0\0", 4)); },
               "truncated"});
  m.push_back({"A glTF that is none", build, [](W w) { return mesh(w, "a.gltf", "{}"); }, "a.gltf"});
  m.push_back({"A mesh in millimetres", build, [](W w) { return mesh(w, "a.ply", Workshop::box(1000.0)); },
               "--scale"});
  m.push_back({"A stray vertex a hundred kilometres away", build,
               [](W w) {
                 std::string t = Workshop::box();
                 t.replace(t.find("1 0.75 0.5\n"), 11, "1e5 0.75 0.5\n");
                 return mesh(w, "a.ply", t);
               },
               "1 of 8 vertices"});
  // arguments
  m.push_back({"--scale 0", build,
               [](W w) {
                 return mesh(w, "a.ply", Workshop::box(), {"--scale", "0"});
               },
               "--scale", 2});
  m.push_back({"A mesh and frames at once", build,
               [](W w) {
                 return mesh(w, "a.ply", Workshop::box(), {"--frames", w / "frames"});
               },
               "one of", 2});
  m.push_back({"No --output", build, [](W w) { return Words{"--mesh", w / "box.ply"}; }, "--output", 2});
  m.push_back({"An option misspelt", build,
               [](W w) {
                 return mesh(w, "a.ply", Workshop::box(), {"--voxelsize", "1"});
               },
               "voxelsize", 2});
  m.push_back({"A negative margin", build,
               [](W w) { return mesh(w, "a.ply", Workshop::box(), {"--margin=-1"}); }, "margin", 2});
  m.push_back({"An output folder that is not there", build,
               [](W w) {
                 Words a = mesh(w, "a.ply", Workshop::box());
                 a[3] = w / "no/such/o.ttsdf";
                 return a;
               },
               "no/such"});
  m.push_back({"An option file with an unknown key", build,
               [](W w) {
                 return mesh(w, "a.ply", Workshop::box(), {"--config", w.write("o.yaml", "voxels: 3\n")});
               },
               "voxels", 2});
  m.push_back({"An option file that is not there", build,
               [](W w) {
                 return mesh(w, "a.ply", Workshop::box(), {"--config", w / "absent.yaml"});
               },
               "no such file"});
  m.push_back({"An option file with anchors", build,
               [](W w) {
                 return mesh(w, "a.ply", Workshop::box(), {"--config", w.write("o.yaml", "a: &a [*a]\n")});
               },
               "alias"});
  m.push_back({"An option file nested too deep", build,
               [](W w) {
                 return mesh(
                     w, "a.ply", Workshop::box(),
                     {"--config", w.write("o.yaml", std::string(5000, '[') + std::string(5000, ']'))});
               },
               "nested"});
  // clouds, volumes, octrees
  m.push_back({"A cloud of whole numbers", build,
               [](W w) {
                 return Words{"--cloud", w.write("c.pcd", pcd("2 2 2", "I I I", "1", "binary\n123456")),
                              "--output", w / "o"};
               },
               "--scale"});
  m.push_back({"A cloud of three points", build,
               [](W w) {
                 return Words{"--cloud", w / "scan.xyz", "--output", w / "o"};
               },
               "at least 50"});
  m.push_back({"A .vdb file that is none", build,
               [](W w) {
                 return Words{"--vdb", w.write("a.vdb", "hello, this is no volume"), "--output", w / "o"};
               },
               "a.vdb"});
  m.push_back({"An octree that is none", build,
               [](W w) {
                 return Words{"--octomap", w.write("a.bt", "hello, this is no octree"), "--output", w / "o"};
               },
               "a.bt"});
  m.push_back(
      {"An octree of another type", build,
       [](W w) {
         return Words{
             "--octomap",
             w.write("a.bt", "# Octomap OcTree binary file\nid CountingOcTree\nsize 1\nres 0.1\ndata\n"),
             "--output", w / "o"};
       },
       "CountingOcTree"});
  m.push_back({"--grid without --vdb", build,
               [](W w) {
                 return mesh(w, "a.ply", Workshop::box(), {"--grid", "x"});
               },
               "--vdb", 2});
  // frames
  m.push_back({"A frame folder that is not there", build, [](W w) { return frames(w, w / "absent"); },
               "no such folder"});
  m.push_back({"A folder without frames", build,
               [](W w) {
                 fs::create_directories(w / "empty");
                 return frames(w, w / "empty");
               },
               "ScanNet"});
  m.push_back({"The folder above the sequences", build,
               [](W w) {
                 fs::create_directories(w / "above");
                 fs::create_directory_symlink(w / "frames", w / "above/seq-01");
                 return frames(w, w / "above");
               },
               "seq-01"});
  m.push_back({"Frames without poses", build,
               [](W w) {
                 fs::create_directories(w / "noposes");
                 fs::copy_file(w / "frames/frame-000000.depth.pgm", w / "noposes/frame-000000.depth.pgm");
                 return frames(w, w / "noposes");
               },
               "none with a pose"});
  m.push_back({"Frames without intrinsics", build,
               [](W w) {
                 w.frames("nok", [](auto T) { return T; });
                 fs::remove(w / "nok/camera-intrinsics.txt");
                 return frames(w, w / "nok");
               },
               "--intrinsics"});
  m.push_back({"Intrinsics of another image size", build,
               [](W w) {
                 return frames(w, w / "frames", {"--intrinsics", "576,576,319.5,239.5"});
               },
               "principal point"});
  m.push_back({"A focal length in metres", build,
               [](W w) {
                 return frames(w, w / "frames", {"--intrinsics", "0.0036,0.0036,31.5,23.5"});
               },
               "focal length"});
  m.push_back({"A negative focal length", build,
               [](W w) { return frames(w, w / "frames", {"--intrinsics=-57.6,57.6,31.5,23.5"}); },
               "sign of fx"});
  m.push_back({"Three numbers of intrinsics", build,
               [](W w) {
                 return frames(w, w / "frames", {"--intrinsics", "57,31,23"});
               },
               "4 numbers", 2});
  m.push_back({"Poses that map the world to the camera", build,
               [](W w) { return frames(w, w.frames("w2c", [](auto T) { return T.inverse(); })); },
               "--poses world-to-camera"});
  m.push_back({"Poses with OpenGL's camera axes", build,
               [](W w) {
                 return frames(w, w.frames("gl", [](auto T) {
                   Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
                   turn.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
                   return T * turn;
                 }));
               },
               "--camera-axes opengl"});
  m.push_back({"Poses with y the other way round in their positions only", build,
               [](W w) {
                 return frames(w, w.frames("my", [](auto T) {
                   T.translation().y() *= -1.0;
                   return T;
                 }));
               },
               "--mirror-poses positions-y"});
  m.push_back({"Poses in millimetres", build,
               [](W w) {
                 return frames(w, w.frames("mm", [](auto T) {
                   T.translation() *= 1000.0;
                   return T;
                 }));
               },
               "--pose-scale 0.001"});
  m.push_back({"Depth in tenths of a millimetre", build,
               [](W w) {
                 return frames(w, w.frames(
                                      "tenth", [](auto T) { return T; }, 10000.0));
               },
               "--depth-scale 10000"});
  m.push_back({"Depth in centimetres", build,
               [](W w) {
                 return frames(w, w.frames(
                                      "cm", [](auto T) { return T; }, 100.0));
               },
               "--depth-scale 100"});
  m.push_back({"--every larger than the folder, with an offset", build,
               [](W w) {
                 return Words{"--frames", w / "frames", "--output", w / "out.ttsdf",
                              "--every",  "100",        "--offset", "50"};
               },
               "no usable frame"});
  m.push_back({"--poses misspelt", build,
               [](W w) {
                 return frames(w, w / "frames", {"--poses", "c2w"});
               },
               "camera-to-world", 2});
  // scans and lists
  m.push_back({"A map that is not there", reg,
               [](W w) {
                 Words a = scan(w, "s.xyz", "1 2 3\n");
                 a[1] = w / "absent.ttsdf";
                 return a;
               },
               "absent.ttsdf"});
  m.push_back({"A mesh as the map", reg,
               [](W w) {
                 Words a = scan(w, "s.xyz", "1 2 3\n");
                 a[1] = w / "box.ply";
                 return a;
               },
               "got"});
  m.push_back({"A list without a prior", reg,
               [](W w) {
                 Words a = scan(w, "s.xyz", "1 2 3\n");
                 a[3] = w.write("l.txt", "s.xyz\n");
                 return a;
               },
               "line 1"});
  m.push_back({"A name with blanks without quotes", reg,
               [](W w) {
                 Words a = scan(w, "s.xyz", "1 2 3\n");
                 a[3] = w.write("l.txt", "my scan 1.xyz prior.txt\n");
                 return a;
               },
               "quotes"});
  m.push_back({"A quote that does not end", reg,
               [](W w) {
                 Words a = scan(w, "s.xyz", "1 2 3\n");
                 a[3] = w.write("l.txt", "\"my scan.xyz prior.txt\n");
                 return a;
               },
               "quote"});
  m.push_back({"A scan in whole millimetres", reg,
               [](W w) { return scan(w, "s.pcd", pcd("2 2 2", "I I I", "1", "binary\n123456")); },
               "whole numbers"});
  m.push_back({"A PCD cut off", reg,
               [](W w) { return scan(w, "s.pcd", pcd("4 4 4", "F F F", "100", "binary\n123456")); },
               "truncated"});
  m.push_back({"A PCD without x y z", reg,
               [](W w) {
                 std::string t = pcd("4 4 4", "F F F", "1", "ascii\n1 2 3\n");
                 t.replace(t.find("x y z"), 5, "u v w");
                 return scan(w, "s.pcd", t);
               },
               "no field 'x'"});
  m.push_back({"A .bin of x y z intensity", reg,
               [](W w) {
                 std::string t;
                 for (int n = 0; n < 64; ++n) {
                   const float p[4] = {3.0F + static_cast<float>(n), -5.0F, 7.0F, 0.5F};
                   t.append(reinterpret_cast<const char*>(p), 16);
                 }
                 return scan(w, "s.bin", t);
               },
               "intensity"});
  m.push_back({"A text cloud with a word in it", reg,
               [](W w) { return scan(w, "s.xyz", "1 2 3\n4 five 6\n"); }, "line 2"});
  m.push_back({"A prior that is no rotation", reg,
               [](W w) {
                 w.write("identity.txt", "2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n");
                 Words a = scan(w, "s.xyz", "1 2 3\n");
                 return a;
               },
               "rotation"});
  return m;
}

/// The whole page.
std::string pageOf(const std::vector<std::pair<std::string, std::string>>& rows) {
  std::string text =
      "# Common mistakes with files and arguments\n"
      "\nWhat the tools say to each of them. Written by `test/documentation/troubleshooting_test.cpp`, "
      "which\n"
      "makes every mistake and prints the answer; to write the page anew, set `TTSDF_UPDATE_CONFIG=1` in "
      "the\n"
      "environment of that test. What the nodes say: [troubleshooting](troubleshooting.md).\n\n"
      "| mistake | what the tool says |\n|---|---|\n";
  for (const auto& [what, message] : rows) {
    // assimp's own words differ from release to release.
    constexpr char kOurs[] = "assimp cannot read it";
    const std::size_t ours = message.find(kOurs);
    std::string cell;
    for (const char c : message.substr(0, ours == std::string::npos ? ours : ours + sizeof(kOurs) - 1))
      cell += c == '|' ? std::string("\\|") : std::string(1, c);
    text += "| " + what + " | " + cell + " |\n";
  }
  return text;
}

TEST(Troubleshooting, EveryMistakeGetsItsMessage) {
  const Workshop w;
  ASSERT_EQ(w.good().exit_code, 0) << w.good().err;
  const std::string folder = fs::path(w / "x").parent_path().string() + "/";
  std::vector<std::pair<std::string, std::string>> rows;
  for (const Mistake& mistake : mistakes()) {
    SCOPED_TRACE(mistake.what);
    const ToolRun run = runProcess(mistake.tool, mistake.arguments(w));
    expectError(run, mistake.exit_code, {mistake.holds});
    std::string message = linesOf(run.err).empty() ? "" : linesOf(run.err).front();
    for (std::size_t at = message.find(folder); at != std::string::npos; at = message.find(folder))
      message.erase(at, folder.size());
    rows.emplace_back(mistake.what, message);
  }
  EXPECT_GE(rows.size(), 60u);
  const std::string path = std::string(TTSDF_SOURCE_DIR) + "/doc/mistakes.md";
  if (std::getenv("TTSDF_UPDATE_CONFIG")) std::ofstream(path) << pageOf(rows);
  EXPECT_EQ(fileText(path), pageOf(rows)) << "run this test with TTSDF_UPDATE_CONFIG=1";
}

}  // namespace
}  // namespace ttsdf

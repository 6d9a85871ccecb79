// doc/mistakes.md: common mistakes with the message that each gets, printed by running the tools on them.
// Written anew with TTSDF_UPDATE_CONFIG=1.

#include <gtest/gtest.h>

#include "workshop.h"

namespace ttsdf {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;
using Words = std::vector<std::string>;

Words operator+(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// Makes mistakes, checks that the answer holds the words given, and keeps it for the page.
class Mistakes : public Workshop {
 public:
  void tried(const std::string& what, const std::string& tool, const Words& arguments,
             const std::string& holds, int exit_code = 1) {
    SCOPED_TRACE(what);
    const ToolRun run = runProcess(tool, arguments);
    expectError(run, exit_code, {holds});
    rows_ += "| " + what + " | " + cell(linesOf(run.err + '\n').front()) + " |\n";
    ++count_;
  }
  void build(const std::string& what, const Words& arguments, const std::string& holds, int exit_code = 1) {
    tried(what, "ttsdf_build", arguments, holds, exit_code);
  }
  /// A mesh of this content.
  void mesh(const std::string& what, const std::string& name, const std::string& content,
            const std::string& holds) {
    build(what, Words{"--mesh", write(name, content)} + output(), holds);
  }
  /// A good mesh with options that are not.
  void options(const std::string& what, const Words& options, const std::string& holds, int exit_code = 2) {
    build(what, Words{"--mesh", *this / "box.ply"} + output() + options, holds, exit_code);
  }
  void sequence(const std::string& what, const std::string& folder, const std::string& holds,
                const Words& options = {}, int exit_code = 1) {
    build(what, Words{"--frames", folder, "--every", "1"} + output() + options, holds, exit_code);
  }
  /// `list` to be registered against `map`.
  void registered(const std::string& what, const std::string& map, const std::string& list,
                  const std::string& holds) {
    tried(what, "ttsdf_register",
          {"--map", *this / map, "--batch", write("l.txt", list), "--output", *this / "out.csv"}, holds);
  }
  void scan(const std::string& what, const std::string& name, const std::string& content,
            const std::string& holds) {
    const std::string scan = write(name, content);
    registered(what, "box.ttsdf", '"' + scan + "\" \"" + (*this / "identity.txt") + "\"\n", holds);
  }

  Words output(const std::string& name = "out.ttsdf") const {
    return {"--output", *this / name, "--voxel-size", "0.1", "--truncation", "0.3"};
  }
  int count() const { return count_; }
  std::string page() const {
    return "# Common mistakes with files and arguments\n"
           "\nWhat the tools say to each of them. Written by `test/documentation/troubleshooting_test.cpp`, "
           "which\n"
           "makes every mistake and prints the answer; to write the page anew, set `TTSDF_UPDATE_CONFIG=1` "
           "in the\n"
           "environment of that test. What the nodes say: [troubleshooting](troubleshooting.md).\n\n"
           "| mistake | what the tool says |\n|---|---|\n" +
           rows_;
  }

 private:
  /// Without the folder, and without assimp's own words, which differ from release to release.
  std::string cell(std::string message) const {
    const std::string folder = *this / "", assimp = "assimp cannot read it";
    for (std::size_t at = message.find(folder); at != std::string::npos; at = message.find(folder))
      message.erase(at, folder.size());
    if (message.find(assimp) != std::string::npos) message.resize(message.find(assimp) + assimp.size());
    std::string escaped;
    for (const char c : message) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
    return escaped;
  }

  std::string rows_;
  int count_ = 0;
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}
std::string boxWithoutFaces() {
  const std::string header =
      replaced(Workshop::box(), "element face 12\nproperty list uchar int vertex_indices\n", "");
  return header.substr(0, header.find("\n3 0 1 3\n") + 1);
}
std::string pcd(const std::string& size, const std::string& type, const std::string& points,
                const std::string& data) {
  return "VERSION 0.7\nFIELDS x y z\nSIZE " + size + "\nTYPE " + type + "\nCOUNT 1 1 1\nWIDTH " + points +
         "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + points + "\nDATA " + data;
}

void tryMeshes(Mistakes& m) {
  const std::string box = Workshop::box();
  m.build("A mesh whose name is misspelt", {"--mesh", m / "absent.ply", "--output", m / "o"}, "no such file");
  m.build("A folder in a mesh's place", {"--mesh", m / "frames", "--output", m / "o"}, "wanted");
  m.mesh("An empty mesh file", "a.ply", "", "empty");
  m.mesh("A mesh that Git LFS has not fetched", "a.ply", "version https://git-lfs.github.com/spec/v1\n",
         "git lfs pull");
  m.mesh("A web page saved as a mesh", "a.ply", "<!DOCTYPE html><html></html>", "web page");
  m.mesh("A mesh still zipped", "a.ply", "PK\3\4....", "unpacked");
  m.mesh("A format that is none of a mesh", "a.docx", "text", ".ply");
  m.mesh("A text called .ply", "a.ply", "hello\n", "PLY header");
  m.mesh("A PLY cut off by a broken download", "a.ply", box.substr(0, 300), "truncated");
  m.mesh("A PLY that promises more vertices than it has", "a.ply", replaced(box, "vertex 8", "vertex 800000"),
         "promises");
  m.mesh("A PLY with more data than its header says", "a.ply", box + "3 0 1 2\n", "more data");
  m.mesh("A point cloud as a mesh", "a.ply", boxWithoutFaces(), "--cloud");
  m.mesh("A face with vertex -1", "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", "vertex index -1");
  m.mesh("A face with a vertex that is not there", "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
         "vertex index");
  m.mesh("An OBJ whose indices begin at 0", "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "indices");
  m.mesh("A vertex that is NaN", "a.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", "not finite");
  m.mesh("An OFF without its faces", "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n", "truncated");
  m.mesh("A binary STL cut off", "a.stl", std::string(80, 'x') + std::string("\5\0\0\0", 4), "truncated");
  m.mesh("A glTF that is none", "a.gltf", "{}", "a.gltf");
  m.mesh("A mesh in millimetres", "a.ply", Workshop::box(1000.0), "--scale");
  m.mesh("A stray vertex a hundred kilometres away", "a.ply", replaced(box, "1 0.75 0.5\n", "1e5 0.75 0.5\n"),
         "1 of 8 vertices");
}

void tryArguments(Mistakes& m) {
  m.options("--scale 0", {"--scale", "0"}, "--scale");
  m.options("A mesh and frames at once", {"--frames", m / "frames"}, "one of");
  m.build("No --output", {"--mesh", m / "box.ply"}, "--output", 2);
  m.options("An option misspelt", {"--voxelsize", "1"}, "voxelsize");
  m.options("A negative margin", {"--margin=-1"}, "margin");
  m.build("An output folder that is not there", Words{"--mesh", m / "box.ply"} + m.output("no/such/o.ttsdf"),
          "no/such");
  const auto config = [&m](const std::string& text) { return Words{"--config", m.write("o.yaml", text)}; };
  m.options("An option file with an unknown key", config("voxels: 3\n"), "voxels");
  m.options("An option file that is not there", {"--config", m / "absent.yaml"}, "no such file", 1);
  m.options("An option file with anchors", config("a: &a [*a]\n"), "alias", 1);
  m.options("An option file nested too deep", config(std::string(5000, '[') + std::string(5000, ']')),
            "nested", 1);
}

void tryCloudsAndVolumes(Mistakes& m) {
  const auto source = [&m](const std::string& what, const std::string& flag, const std::string& file,
                           const std::string& holds) {
    m.build(what, {flag, file, "--output", m / "o"}, holds);
  };
  source("A cloud of whole numbers", "--cloud",
         m.write("c.pcd", pcd("2 2 2", "I I I", "1", "binary\n123456")), "--scale");
  source("A cloud of three points", "--cloud", m / "scan.xyz", "at least 50");
  source("A .vdb file that is none", "--vdb", m.write("a.vdb", "hello, this is no volume"), "a.vdb");
  source("An octree that is none", "--octomap", m.write("a.bt", "hello, this is no octree"), "a.bt");
  source("An octree of another type", "--octomap",
         m.write("a.bt", "# Octomap OcTree binary file\nid CountingOcTree\nsize 1\nres 0.1\ndata\n"),
         "CountingOcTree");
  m.options("--grid without --vdb", {"--grid", "x"}, "--vdb");
}

void tryFrames(Mistakes& m) {
  const std::string good = m / "frames", frame = "frame-000000.depth.pgm";
  m.sequence("A frame folder that is not there", m / "absent", "no such folder");
  fs::create_directories(m / "empty");
  m.sequence("A folder without frames", m / "empty", "ScanNet");
  fs::create_directories(m / "above");
  fs::create_directory_symlink(good, m / "above/seq-01");
  m.sequence("The folder above the sequences", m / "above", "seq-01");
  fs::create_directories(m / "noposes");
  fs::copy_file(fs::path(good) / frame, fs::path(m / "noposes") / frame);
  m.sequence("Frames without poses", m / "noposes", "none with a pose");
  m.frames("nok", [](const Isometry3d& T) { return T; });
  fs::remove(m / "nok/camera-intrinsics.txt");
  m.sequence("Frames without intrinsics", m / "nok", "--intrinsics");
  m.sequence("Intrinsics of another image size", good, "principal point",
             {"--intrinsics", "576,576,319.5,239.5"});
  m.sequence("A focal length in metres", good, "focal length", {"--intrinsics", "0.0036,0.0036,31.5,23.5"});
  m.sequence("A negative focal length", good, "sign of fx", {"--intrinsics=-57.6,57.6,31.5,23.5"});
  m.sequence("Three numbers of intrinsics", good, "4 numbers", {"--intrinsics", "57,31,23"}, 2);

  const auto posed = [&m](const std::string& what, const std::string& folder, const std::string& holds,
                          const std::function<Isometry3d(Isometry3d)>& pose) {
    m.sequence(what, m.frames(folder, pose), holds);
  };
  posed("Poses that map the world to the camera", "w2c", "--poses world-to-camera",
        [](const Isometry3d& T) { return T.inverse(); });
  posed("Poses with OpenGL's camera axes", "gl", "--camera-axes opengl", [](Isometry3d T) {
    T.linear() = T.linear() * Eigen::Vector3d(1, -1, -1).asDiagonal();
    return T;
  });
  posed("Poses with y the other way round in their positions only", "my", "--mirror-poses positions-y",
        [](Isometry3d T) {
          T.translation().y() *= -1.0;
          return T;
        });
  posed("Poses in millimetres", "mm", "--pose-scale 0.001", [](Isometry3d T) {
    T.translation() *= 1000.0;
    return T;
  });
  const auto same = [](const Isometry3d& T) { return T; };
  m.sequence("Depth in tenths of a millimetre", m.frames("tenth", same, 10000.0), "--depth-scale 10000");
  m.sequence("Depth in centimetres", m.frames("cm", same, 100.0), "--depth-scale 100");
  m.build("--every larger than the folder, with an offset",
          {"--frames", good, "--output", m / "out.ttsdf", "--every", "100", "--offset", "50"},
          "no usable frame");
  m.sequence("--poses misspelt", good, "camera-to-world", {"--poses", "c2w"}, 2);
}

void tryScans(Mistakes& m) {
  const std::string good = m.write("s.xyz", "1 2 3\n") + ' ' + (m / "identity.txt") + '\n';
  m.registered("A map that is not there", "absent.ttsdf", good, "absent.ttsdf");
  m.registered("A mesh as the map", "box.ply", good, "got");
  m.registered("A list without a prior", "box.ttsdf", "s.xyz\n", "line 1");
  m.registered("A name with blanks without quotes", "box.ttsdf", "my scan 1.xyz prior.txt\n", "quotes");
  m.registered("A quote that does not end", "box.ttsdf", "\"my scan.xyz prior.txt\n", "quote");
  m.scan("A scan in whole millimetres", "s.pcd", pcd("2 2 2", "I I I", "1", "binary\n123456"),
         "whole numbers");
  m.scan("A PCD cut off", "s.pcd", pcd("4 4 4", "F F F", "100", "binary\n123456"), "truncated");
  m.scan("A PCD without x y z", "s.pcd",
         replaced(pcd("4 4 4", "F F F", "1", "ascii\n1 2 3\n"), "x y z", "u v w"), "no field 'x'");
  std::string rows;
  for (int n = 0; n < 64; ++n) {
    const float p[4] = {3.0F + static_cast<float>(n), -5.0F, 7.0F, 0.5F};
    rows.append(reinterpret_cast<const char*>(p), sizeof p);
  }
  m.scan("A .bin of x y z intensity", "s.bin", rows, "intensity");
  m.scan("A text cloud with a word in it", "s.xyz", "1 2 3\n4 five 6\n", "line 2");
  m.write("identity.txt", "2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n");
  m.scan("A prior that is no rotation", "s.xyz", "1 2 3\n", "rotation");
}

TEST(Troubleshooting, EveryMistakeGetsItsMessage) {
  Mistakes m;
  tryMeshes(m);
  tryArguments(m);
  tryCloudsAndVolumes(m);
  tryFrames(m);
  tryScans(m);
  EXPECT_GE(m.count(), 60);
  const std::string path = std::string(TTSDF_SOURCE_DIR) + "/doc/mistakes.md";
  if (std::getenv("TTSDF_UPDATE_CONFIG")) std::ofstream(path) << m.page();
  EXPECT_EQ(fileContent(path), m.page()) << "run this test with TTSDF_UPDATE_CONFIG=1";
}

}  // namespace
}  // namespace ttsdf

// Nothing that a user can put in a file ends a process by a signal or keeps it for ever: small files of every
// format with bytes changed, cut off and repeated, read in this very process. A seed each, so that a failure
// comes back.

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <random>

#include "../support/temp_folder.h"
#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/fusion/tsdf_volume.h"
#include "ttsdf_localization/readers/cloud_file.h"
#include "ttsdf_localization/surface/surface_mesh.h"
#include "ttsdf_localization/tools/option_file.h"
#include "ttsdf_localization/tools/scan_io.h"

namespace ttsdf {
namespace {

using testing::TempFolder;

/// One to four changes: a byte, a run of equal bytes, an end cut off, a piece repeated, digits made large.
std::string mutated(std::string text, std::mt19937& random) {
  const auto below = [&random](std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(random() % n); };
  for (std::size_t change = 1 + below(4); change > 0 && !text.empty(); --change) {
    const std::size_t at = below(text.size());
    switch (below(6)) {
      case 0:
        text[at] = static_cast<char>(random());
        break;
      case 1:
        text[at] = static_cast<char>(text[at] ^ (1 << below(8)));
        break;
      case 2:
        text.resize(at);
        break;
      case 3:
        text.insert(at, text.substr(below(text.size()), below(64)));
        break;
      case 4:
        text.replace(at, std::min<std::size_t>(4, text.size() - at), std::string(4, static_cast<char>(0xff)));
        break;
      default:
        text.insert(at, "99999999");
    }
  }
  return text;
}

/// Reads `count` mutants of a file. Any std::exception is an answer; a signal ends the test program.
void readMutants(const std::string& name, const std::string& good, int count,
                 const std::function<void(const std::string&)>& read) {
  const TempFolder folder;
  ASSERT_NO_THROW(read(folder.write(name, good))) << name;
  std::mt19937 random(17);
  int refused = 0;
  for (int n = 0; n < count; ++n) {
    const std::string path = folder.write(name, mutated(good, random));
    const auto begin = std::chrono::steady_clock::now();
    try {
      read(path);
    } catch (const std::exception& error) {
      ++refused;
      EXPECT_NE(std::string(error.what()), "");
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    EXPECT_LT(seconds, 30.0) << name << ", mutant " << n;
  }
  EXPECT_GT(refused, count / 50) << name;
}

template <class T>
void append(std::string& text, T value) {
  text.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

std::string binaryPly() {
  std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty "
      "float z\n"
      "element face 3\nproperty list uchar int vertex_indices\nend_header\n";
  for (const float x : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 1.F, 1.F, 1.F})
    append(text, x);
  for (const int corners : {3, 4, 5}) {
    text += static_cast<char>(corners);
    for (int c = 0; c < corners; ++c) append(text, c);
  }
  return text;
}
const char kAsciiPly[] =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double "
    "z\nelement tristrips 1\n"
    "property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n6 0 1 2 3 -1 0\n";
const char kOff[] = "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n4 0 1 2 3\n";
const char kObj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.1\nf 1/1/1 2 3\nf -4 -3 -1 -2\n";
const char kStl[] =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
    "0\nendloop\nendfacet\nendsolid a\n";
const char kGltf[] =
    R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":)"
    R"({"POSITION":0}}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","max":[1,1,0],"min":[0,0,0]}],)"
    R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)"
    R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";

std::string pcd(const std::string& kind) {
  std::string text =
      "VERSION 0.7\nFIELDS x y z i\nSIZE 4 8 4 1\nTYPE F F F U\nCOUNT 1 1 1 2\nWIDTH 2\nHEIGHT 2\nVIEWPOINT "
      "0 0 0 1 0 0 0\n"
      "POINTS 4\nDATA " +
      kind + "\n";
  if (kind == "ascii") return text + "1 2 3 4 5\n1 2 3 4 5\nnan 2 3 4 5\n1 2 3 4 5\n";
  std::string data(4 * 18, '\2');
  if (kind == "binary") return text + data;
  std::string packed;
  for (std::size_t at = 0; at < data.size(); at += 24)
    packed += std::string(1, char{23}) + data.substr(at, 24);
  append(text, static_cast<std::uint32_t>(packed.size()));
  append(text, static_cast<std::uint32_t>(data.size()));
  return text + packed;
}

TEST(MutatedFiles, Meshes) {
  const auto read = [](const std::string& path) { readMesh(path); };
  readMutants("a.ply", binaryPly(), 600, read);
  readMutants("b.ply", kAsciiPly, 600, read);
  readMutants("c.off", kOff, 600, read);
  readMutants("d.obj", kObj, 600, read);
  readMutants("e.stl", kStl, 300, read);
  readMutants("f.gltf", kGltf, 40, read);
}

TEST(MutatedFiles, Clouds) {
  const auto read = [](const std::string& path) { readCloudFile(path); };
  for (const char* kind : {"ascii", "binary", "binary_compressed"})
    readMutants("a.pcd", pcd(kind), 600, read);
  readMutants("b.ply", binaryPly(), 300, read);
  readMutants("c.xyz", "1 2 3\n4 5 6\n7 8 9\n", 300, read);
}

TEST(MutatedFiles, Volumes) {
  const TempFolder folder;
  openvdb::initialize();
  const auto sphere =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(0.3F, openvdb::Vec3f(0.0F), 0.05F, 3.0F);
  openvdb::io::File file(folder.file("a.vdb"));
  file.write({sphere});
  file.close();
  FusionOptions coarse;
  coarse.voxel_size = 0.05, coarse.truncation = 0.15;
  readMutants("a.vdb", testing::fileContent(folder.file("a.vdb")), 60,
              [&coarse](const std::string& path) { TsdfVolume::fromVdbFile(path, coarse); });
}

TEST(MutatedFiles, Frames) {
  const std::string pgm = "P5\n4 3\n65535\n" + std::string(24, '\3');
  readMutants("a.pgm", pgm, 300, [](const std::string& path) { readDepthImage(path, 1000.0); });
  readMutants("pose.txt", "1 0 0 0.5\n0 1 0 1.5\n0 0 1 -2\n0 0 0 1\n", 300,
              [](const std::string& path) { readPose(path); });
  const TempFolder folder;
  std::filesystem::create_directories(folder.file("depth"));
  folder.write("depth/0.pgm", pgm);
  folder.write("depth/1.pgm", pgm);
  folder.write("intrinsics.txt", "4 0 2\n0 4 1.5\n0 0 1\n");
  const auto open = [&folder](const std::string&) { FrameFolder(folder.path(), FrameFolderOptions()); };
  const std::string log =
      "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 1 2\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  readMutants("x.log", log, 300, [&](const std::string& path) {
    folder.write("trajectory.log", testing::fileContent(path));
    open(path);
  });
}

TEST(MutatedFiles, OptionFilesAndLists) {
  readMutants("o.yaml", "voxel_size: 0.02\nbuild: {max_rank: '40', margin: 0.2}\nlist: [1, 2, [3]]\n", 600,
              [](const std::string& path) { loadOptionFile(path); });
  readMutants("l.txt", "a.pcd p.txt t.txt\n\"b c.ply\" p.txt\n", 300,
              [](const std::string& path) { readBatch(path); });
}

}  // namespace
}  // namespace ttsdf

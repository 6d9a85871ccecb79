// Meshes as people have them, and as they break. The box of 2 x 1.5 x 1 m is written here in every format.

#include "ttsdf_localization/readers/triangle_file.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <sstream>

#include "../support/temp_folder.h"

namespace ttsdf {
namespace {

using testing::TempFolder;
using testing::thrownMessage;

const double kHalf[3] = {1.0, 0.75, 0.5};
const int kFaces[12][3] = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                           {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};

double corner(int n, int axis) { return ((n >> (2 - axis)) & 1) != 0 ? kHalf[axis] : -kHalf[axis]; }

template <class T>
std::string bytes(T value, bool big = false) {
  std::string text(reinterpret_cast<const char*>(&value), sizeof(value));
  return big ? std::string(text.rbegin(), text.rend()) : text;
}

std::string plyHeader(const std::string& format, const std::string& type, int vertices,
                      const std::string& rest) {
  std::string text = "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(vertices);
  for (const char* axis : {"x", "y", "z"}) text += "\nproperty " + type + " " + axis;
  return text + "\n" + rest + "end_header\n";
}
const std::string kFaceElement = "element face 12\nproperty list uchar int vertex_indices\n";

std::string asciiBox(double scale = 1.0, double x = 0.0, double y = 0.0) {
  std::ostringstream out;
  out.precision(17);
  out << plyHeader("ascii", "double", 8, kFaceElement);
  for (int n = 0; n < 8; ++n) {
    out << scale * corner(n, 0) + x << ' ' << scale * corner(n, 1) + y << ' ' << scale * corner(n, 2) << '\n';
  }
  for (const auto& f : kFaces) out << "3 " << f[0] << ' ' << f[1] << ' ' << f[2] << '\n';
  return out.str();
}

template <class T>
std::string binaryBox(const std::string& type, bool big) {
  std::string out = plyHeader(big ? "binary_big_endian" : "binary_little_endian", type, 8, kFaceElement);
  for (int n = 0; n < 8; ++n) {
    for (int axis = 0; axis < 3; ++axis) out += bytes(static_cast<T>(4.0 * corner(n, axis)), big);
  }
  for (const auto& f : kFaces) {
    out += '\3';
    for (const int index : f) out += bytes(static_cast<std::int32_t>(index), big);
  }
  return out;
}

double areaOf(const TriangleFile& mesh) {
  double area = 0.0;
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.triangles(0, n)),
                          b = mesh.vertices.col(mesh.triangles(1, n)),
                          c = mesh.vertices.col(mesh.triangles(2, n));
    const Eigen::Vector3d u = b - a, v = c - a;
    area +=
        0.5 * Eigen::Vector3d(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
                  .norm();
  }
  return area;
}

void expectBox(const TriangleFile& mesh, double scale, const std::string& what) {
  SCOPED_TRACE(what);
  EXPECT_EQ(mesh.vertices.cols(), 8);
  EXPECT_EQ(mesh.triangles.cols(), 12);
  const Eigen::Vector3d size = mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff();
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(size[axis], 2.0 * scale * kHalf[axis], 1e-9 * scale);
  EXPECT_NEAR(areaOf(mesh), 13.0 * scale * scale, 1e-9 * scale * scale);  // 2 (2 x 1.5 + 1.5 x 1 + 2 x 1)
}

class TriangleFiles : public ::testing::Test {
 protected:
  TriangleFile read(const std::string& name, const std::string& content) {
    return readTriangles(folder_.write(name, content));
  }
  std::string refusal(const std::string& name, const std::string& content) {
    const std::string path = folder_.write(name, content);
    const std::string message = thrownMessage<std::runtime_error>([&] { readTriangles(path); });
    EXPECT_NE(message.find(path), std::string::npos) << name << ": '" << message << "'";
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  }

  TempFolder folder_;
};

TEST_F(TriangleFiles, PlyOfEveryTypeAndByteOrder) {
  expectBox(read("a.ply", asciiBox()), 1.0, "ascii");
  std::string crlf;
  for (const char c : asciiBox()) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expectBox(read("b.ply", crlf), 1.0, "CRLF");
  for (const bool big : {false, true}) {
    expectBox(read("c.ply", binaryBox<float>("float", big)), 4.0, "float");
    expectBox(read("d.ply", binaryBox<double>("double", big)), 4.0, "double");
    expectBox(read("e.ply", binaryBox<std::int16_t>("short", big)), 4.0, "short");
    expectBox(read("f.ply", binaryBox<std::int32_t>("int32", big)), 4.0, "int32");
    expectBox(read("g.ply", binaryBox<std::int8_t>("char", big)), 4.0, "char");
  }
}

TEST_F(TriangleFiles, TinyUnitsAndFarPlacesKeepTheirVertices) {
  expectBox(read("tiny.ply", asciiBox(1e-6)), 1e-6, "micrometres as metres");
  const TriangleFile utm = read("utm.ply", asciiBox(1.0, 356789.123, 5412345.678));
  EXPECT_EQ(utm.vertices.cols(), 8);
  const Eigen::Vector3d size = utm.vertices.rowwise().maxCoeff() - utm.vertices.rowwise().minCoeff();
  EXPECT_NEAR(size.x(), 2.0, 1e-8);
  EXPECT_NEAR(size.y(), 1.5, 1e-8);
}

TEST_F(TriangleFiles, StripsAndElementsBeforeTheVertices) {
  std::string strips = asciiBox();
  strips.replace(strips.find(kFaceElement), kFaceElement.size(),
                 "element tristrips 1\nproperty list int int vertex_indices\n");
  strips.resize(strips.find("\n3 0 1 3\n") + 1);
  expectBox(
      read("strips.ply", strips + "30 0 1 2 3 -1 4 6 5 7 -1 0 4 1 5 -1 2 3 6 7 -1 0 2 4 6 -1 1 5 3 7 -1\n"),
      1.0, "strips");
  std::string first = binaryBox<float>("float", false);
  first.insert(first.find("element vertex"),
               "element camera 2\nproperty list uchar float view\nproperty short id\n");
  first.insert(first.find("end_header\n") + 11, std::string("\1") + bytes(2.5F) + bytes<std::int16_t>(7) +
                                                    std::string(1, '\0') + bytes<std::int16_t>(8));
  expectBox(read("camera.ply", first), 4.0, "camera first");
}

TEST_F(TriangleFiles, StripsTurnEverySecondTriangle) {
  std::string text =
      plyHeader("ascii", "float", 4, "element tristrips 1\nproperty list int int vertex_indices\n") +
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n4 0 1 2 3\n";
  const TriangleFile mesh = read("s.ply", text);
  ASSERT_EQ(mesh.triangles.cols(), 2);
  for (Eigen::Index n = 0; n < 2; ++n) {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.triangles(0, n)),
                          b = mesh.vertices.col(mesh.triangles(1, n)),
                          c = mesh.vertices.col(mesh.triangles(2, n));
    EXPECT_GT((b - a).x() * (c - a).y() - (b - a).y() * (c - a).x(), 0.0);  // both face +z
  }
}

TEST_F(TriangleFiles, EveryTruncationIsRefused) {
  for (const std::string& whole :
       {asciiBox(), binaryBox<float>("float", false), binaryBox<double>("double", true)}) {
    // From one byte to all but the last face; an ascii file may lose its last line end.
    for (std::size_t size = 1; size + 4 < whole.size(); size += 7) {
      EXPECT_FALSE(refusal("t.ply", whole.substr(0, size)).empty()) << size;
    }
    EXPECT_FALSE(refusal("t.ply", whole + whole).empty());
  }
}

TEST_F(TriangleFiles, IndicesOutOfRangeAreNamed) {
  for (const std::int32_t index : {-1, 8, 999999, -2147483647 - 1, 2147483647}) {
    std::string text = binaryBox<float>("float", false);
    text.replace(text.size() - 4, 4, bytes(index));
    EXPECT_NE(refusal("i.ply", text).find("vertex index " + std::to_string(index)), std::string::npos);
    const std::string faces = "3 0 1 " + std::to_string(index) + "\n";
    EXPECT_NE(refusal("i.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n" + faces).find(std::to_string(index)),
              std::string::npos);
  }
  for (const char* index : {"0", "4", "-4", "999999999999"}) {
    EXPECT_NE(refusal("i.obj", std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 ") + index + "\n").find("ind"),
              std::string::npos);
  }
  EXPECT_EQ(read("n.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n").triangles.cols(), 1);
  EXPECT_EQ(read("n.obj", "f 1/1/1 2//2 3\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\n").triangles.cols(),
            1);
}

TEST_F(TriangleFiles, VerticesThatAreNoNumbersAreRefusedWhereTheyMatter) {
  for (const char* bad : {"nan", "inf", "-inf", "1e400"}) {
    EXPECT_NE(
        refusal("n.obj", std::string("v 0 0 0\nv 1 0 0\nv 0 ") + bad + " 0\nf 1 2 3\n").find("not finite"),
        std::string::npos)
        << bad;
  }
  EXPECT_NE(refusal("w.obj", "v 0 0 0\nv 1 0 0\nv 0 1x 0\nf 1 2 3\n").find("line 3"), std::string::npos);
  EXPECT_EQ(read("unused.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan nan nan\nf 1 2 3\n").vertices.cols(), 3);
}

TEST_F(TriangleFiles, PointsAloneSayWhatToDo) {
  std::string points = asciiBox();
  points.replace(points.find(kFaceElement), kFaceElement.size(), "");
  points.resize(points.find("\n3 0 1 3\n") + 1);
  EXPECT_NE(refusal("points.ply", points).find("--cloud"), std::string::npos);
  EXPECT_NE(refusal("points.obj", "v 0 0 0\nv 1 0 0\n").find("no triangle"), std::string::npos);
  EXPECT_FALSE(refusal("o.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n").empty());
}

TEST_F(TriangleFiles, HeadersThatPromiseTooMuch) {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  for (const char* count : {"4000000000", "999999999999999999", "-1", "1e9", ""}) {
    EXPECT_FALSE(refusal("h.ply", "ply\nformat ascii 1.0\nelement vertex " + std::string(count) + "\n" + xyz +
                                      "end_header\n0 0 0\n")
                     .empty());
    EXPECT_FALSE(refusal("h.off", "OFF\n" + std::string(count) + " 100000000 0\n0 0 0\n").empty());
  }
  EXPECT_FALSE(refusal("cr.ply", "ply\rformat ascii 1.0\relement vertex 4000000000\r").empty());
  EXPECT_FALSE(refusal("fmt.ply", "ply\nformat ascii 1.0\n").empty());
  EXPECT_FALSE(refusal("upper.ply", "PLY\nformat ascii 1.0\nend_header\n").empty());
  EXPECT_FALSE(refusal("list.ply", plyHeader("binary_little_endian", "float", 0,
                                             "element face 1\nproperty list uint int vertex_indices\n") +
                                       bytes<std::uint32_t>(268435456u) + "123")
                   .empty());
  EXPECT_FALSE(refusal("polygon.obj",
                       [] {
                         std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf";
                         for (int n = 0; n < 70000; ++n) text += " 1 2 3";
                         return text + "\n";
                       }())
                   .empty());
}

TEST_F(TriangleFiles, PolygonsAreSplitByTheirShape) {
  // An L, whose fan from the first corner would leave it: area 3.
  const TriangleFile l =
      read("l.obj", "v 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nv 2 0 0\nf 1 2 3 4 5 6\n");
  EXPECT_EQ(l.triangles.cols(), 4);
  EXPECT_NEAR(areaOf(l), 3.0, 1e-12);
  const TriangleFile quad =
      read("q.off", "OFF 5 2 0\n0 0 0\n1 0 0 # one\n0 1 0\n0 0 1\n1 1 0\n4 0 1 4 2\n3 0 2 3\n");
  EXPECT_EQ(quad.triangles.cols(), 3);
}

TEST_F(TriangleFiles, Stl) {
  std::string binary(80, 'x'), text = "solid box\n";
  binary += bytes<std::uint32_t>(12);
  for (const auto& f : kFaces) {
    binary += std::string(12, '\0');
    text += "facet normal 0 0 1\nouter loop\n";
    for (const int n : f) {
      text += "vertex";
      for (int axis = 0; axis < 3; ++axis) {
        binary += bytes(static_cast<float>(corner(n, axis)));
        text += " " + std::to_string(corner(n, axis));
      }
      text += "\n";
    }
    binary += std::string(2, '\0');
    text += "endloop\nendfacet\n";
  }
  text += "endsolid box\n";
  expectBox(read("b.stl", binary), 1.0, "binary");
  expectBox(read("t.stl", text), 1.0, "text");
  for (std::size_t size = 1; size < binary.size(); size += 31)
    EXPECT_FALSE(refusal("b.stl", binary.substr(0, size)).empty());
  for (std::size_t size = 1; size + 14 < text.size(); size += 31)
    EXPECT_FALSE(refusal("t.stl", text.substr(0, size)).empty());
}

TEST_F(TriangleFiles, TextsOfOtherEditors) {
  const std::string mark = "\xef\xbb\xbf";
  expectBox(read("m.ply", mark + asciiBox()), 1.0, "PLY behind a mark of UTF-8");
  EXPECT_EQ(read("m.obj", mark + "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").vertices(0, 0), 0.0);
  EXPECT_EQ(read("m.off", mark + "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").triangles.cols(), 1);
  for (const char* name : {"u.ply", "u.obj", "u.off", "u.stl"})
    EXPECT_NE(refusal(name, std::string("\xff\xfev\0 \0", 6)).find("UTF-16"), std::string::npos) << name;
}

TEST_F(TriangleFiles, HeadersThatPromiseTooLittle) {
  const std::string off = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 1 3 2\n";
  EXPECT_EQ(read("a.off", "OFF\n4 2 0\n" + off + "# the end\n\n").triangles.cols(), 2);
  EXPECT_NE(refusal("b.off", "OFF\n4 1 0\n" + off).find("more data"), std::string::npos);
  EXPECT_NE(refusal("c.ply",
                    plyHeader("ascii", "float", 3, "element face 1\nproperty list float int vertex_index\n") +
                        "0 0 0\n1 0 0\n0 1 0\n3.5 0 1 2\n")
                .find("whole number"),
            std::string::npos);
}

TEST_F(TriangleFiles, SurfacesThatAreNone) {
  EXPECT_NE(refusal("line.obj", "v 0 0 0\nv 1 1 1\nv 3 3 3\nf 1 2 3\n").find("none with an area"),
            std::string::npos);
  const std::string polygon = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const char* patch : {"surf 0 1 0 1 1 2 3\n", "bzp 1 2 3 1 2 3\n", "bsp 1 2 3\n"})
    EXPECT_NE(refusal("patch.obj", polygon + patch).find("free-form"), std::string::npos) << patch;
  const std::string facet = "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n";
  const std::string end = "endloop\nendfacet\n";
  EXPECT_EQ(read("shout.stl",
                 "SOLID A\nFACET NORMAL 0 0 0\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 0 0\nVERTEX 0 1 0\n"
                 "ENDLOOP\nENDFACET\nENDSOLID A\n")
                .triangles.cols(),
            1);
  EXPECT_NE(refusal("six.stl", "solid a\n" + facet + facet + end + "endsolid a\n").find("6 vertices"),
            std::string::npos);
  EXPECT_NE(refusal("none.stl", facet + end).find("begins with 'solid'"), std::string::npos);
  // Binary, whatever its first word says, with a count that lies.
  EXPECT_NE(
      refusal("count.stl", "solid" + std::string(75, ' ') + bytes<std::uint32_t>(3) + std::string(100, '\0'))
          .find("3 triangles"),
      std::string::npos);
}

TEST_F(TriangleFiles, FoldersDevicesAndAbsentFiles) {
  EXPECT_NE(thrownMessage<std::runtime_error>([&] { readTriangles(folder_.path()); }), "");
  EXPECT_NE(thrownMessage<std::runtime_error>([] { readTriangles("/nowhere/a.ply"); }).find("no such file"),
            std::string::npos);
  EXPECT_NE(refusal("empty.ply", "").find("empty"), std::string::npos);
}

}  // namespace
}  // namespace ttsdf

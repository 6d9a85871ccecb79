#include "ttsdf_localization/readers/cloud_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "../support/temp_folder.h"

namespace ttsdf {
namespace {

using testing::TempFolder;
using testing::thrownMessage;

template <class T>
std::string bytes(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

const double kPoints[4][3] = {{1, 2, 3}, {4, 5, 6}, {7, -8, 9}, {-10, 11, 12}};

std::string pcdHeader(const std::string& fields, const std::string& size, const std::string& type,
                      const std::string& count, const std::string& width, const std::string& points,
                      const std::string& data) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + size + "\nTYPE " + type + "\nCOUNT " +
         count + "\nWIDTH " + width + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + points + "\nDATA " +
         data + "\n";
}

template <class T>
std::string pcd(char type) {
  const std::string s = std::to_string(sizeof(T)), t(1, type);
  std::string text =
      pcdHeader("x y pad z", s + " " + s + " 1 " + s, t + " " + t + " U " + t, "1 1 3 1", "4", "4", "binary");
  for (const auto& p : kPoints)
    text += bytes(static_cast<T>(p[0])) + bytes(static_cast<T>(p[1])) + "abc" + bytes(static_cast<T>(p[2]));
  return text;
}

class CloudFiles : public ::testing::Test {
 protected:
  CloudFile read(const std::string& name, const std::string& content) {
    return readCloudFile(folder_.write(name, content));
  }
  std::string refusal(const std::string& name, const std::string& content) {
    const std::string path = folder_.write(name, content);
    const std::string message = thrownMessage<std::runtime_error>([&] { readScanFile(path); });
    EXPECT_NE(message.find(path), std::string::npos) << name << ": '" << message << "'";
    return message;
  }
  void expectPoints(const CloudFile& cloud, const std::string& what) {
    ASSERT_EQ(cloud.points.cols(), 4) << what;
    for (int n = 0; n < 4; ++n) {
      for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(cloud.points(axis, n), kPoints[n][axis]) << what;
    }
  }

  TempFolder folder_;
};

TEST_F(CloudFiles, EveryTypeOfPcd) {
  expectPoints(read("a.pcd", pcd<float>('F')), "float");
  expectPoints(read("b.pcd", pcd<double>('F')), "double");
  expectPoints(read("c.pcd", pcd<std::int16_t>('I')), "int16");
  expectPoints(read("d.pcd", pcd<std::int64_t>('I')), "int64");
  EXPECT_FALSE(read("a.pcd", pcd<float>('F')).whole_numbers);
  EXPECT_NE(refusal("e.pcd", pcd<std::int16_t>('I')).find("whole numbers"), std::string::npos);
}

TEST_F(CloudFiles, TextPcdWithNoReadings) {
  const CloudFile cloud = read(
      "t.pcd", pcdHeader("x y z", "4 4 4", "F F F", "1 1 1", "2", "2", "ascii") + "1 2 3\nnan inf -inf\n");
  ASSERT_EQ(cloud.points.cols(), 2);
  EXPECT_EQ(cloud.points(2, 0), 3.0);
  EXPECT_TRUE(std::isnan(cloud.points(0, 1)) && std::isinf(cloud.points(2, 1)));
  EXPECT_NE(
      refusal("w.pcd", pcdHeader("x y z", "4 4 4", "F F F", "1 1 1", "2", "2", "ascii") + "1 2 3\nx y z\n")
          .find("'x'"),
      std::string::npos);
}

TEST_F(CloudFiles, PcdHeadersThatLie) {
  const std::string data(24, 'x');
  const std::string s4 = "4 4 4", f = "F F F", c1 = "1 1 1";
  const auto header = [&](const std::string& size, const std::string& type, const std::string& count,
                          const std::string& width, const std::string& points, const std::string& kind) {
    return refusal("h.pcd", pcdHeader("x y z", size, type, count, width, points, kind) + data);
  };
  EXPECT_FALSE(header(s4, f, "1 1 1000000000", "2", "2", "binary").empty());
  EXPECT_FALSE(header(s4, f, c1, "-1", "-1", "binary").empty());
  EXPECT_FALSE(header(s4, f, c1, "1000000000", "1000000000", "binary").empty());
  EXPECT_FALSE(header(s4, f, c1, "3", "2", "binary").empty());
  EXPECT_FALSE(header("3 3 3", f, c1, "2", "2", "binary").empty());
  EXPECT_FALSE(header("2147483647 4 4", f, c1, "2", "2", "binary").empty());
  EXPECT_FALSE(header("-4 -4 -4", f, c1, "2", "2", "binary").empty());
  EXPECT_FALSE(header("4 4", f, c1, "2", "2", "binary").empty());
  EXPECT_FALSE(header(s4, "F F Q", c1, "2", "2", "binary").empty());
  EXPECT_FALSE(header(s4, f, c1, "2", "2", "zipped").empty());
  EXPECT_FALSE(header(s4, f, c1, "2", "2", "binary_compressed").empty());
  EXPECT_FALSE(header(s4, f, c1, "65536", "0", "binary").empty());
  EXPECT_FALSE(
      refusal("n.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n").empty());
  EXPECT_FALSE(refusal("x.pcd", pcdHeader("a b", "4 4", "F F", "1 1", "1", "1", "ascii") + "1 2\n").empty());
  const std::string whole = pcd<float>('F');
  for (std::size_t size = 1; size < whole.size(); ++size)
    EXPECT_FALSE(refusal("t.pcd", whole.substr(0, size)).empty()) << size;
}

TEST_F(CloudFiles, PcdHeadersThatPromiseTooLittle) {
  const std::string s4 = "4 4 4", f = "F F F", c1 = "1 1 1", two(24, '\1');
  const std::string head = pcdHeader("x y z", s4, f, c1, "1", "1", "binary");
  EXPECT_NE(refusal("more.pcd", head + two).find("12 bytes more"), std::string::npos);
  EXPECT_EQ(read("fill.pcd", head + two.substr(12) + std::string(100, '\0') + "\n").points.cols(), 1);
  EXPECT_NE(refusal("twice.pcd",
                    pcdHeader("x y z x", "4 4 4 4", "F F F F", "1 1 1 1", "1", "1", "ascii") + "1 2 3 4\n")
                .find("'x' 2 times"),
            std::string::npos);
}

TEST_F(CloudFiles, CompressedPcdIsHeldAgainstItsHeader) {
  const std::string head = pcdHeader("x y z", "4 4 4", "F F F", "1 1 1", "2", "2", "binary_compressed");
  std::string columns;
  for (int axis = 0; axis < 3; ++axis)
    columns += bytes(static_cast<float>(axis + 1)) + bytes(static_cast<float>(axis + 10));
  // A block of literals: LZF's control byte 23 says that 24 bytes follow.
  const std::string packed = std::string(1, char{23}) + columns;
  const CloudFile cloud = read("ok.pcd", head + bytes<std::uint32_t>(25) + bytes<std::uint32_t>(24) + packed);
  ASSERT_EQ(cloud.points.cols(), 2);
  EXPECT_EQ(cloud.points(2, 1), 12.0);
  EXPECT_FALSE(
      refusal("a.pcd", head + bytes<std::uint32_t>(0xf0000000u) + bytes<std::uint32_t>(24) + packed).empty());
  EXPECT_FALSE(refusal("b.pcd", head + bytes<std::uint32_t>(25) + bytes<std::uint32_t>(23) + packed).empty());
  EXPECT_FALSE(refusal("c.pcd", head + bytes<std::uint32_t>(5) + bytes<std::uint32_t>(24) + packed).empty());
  // A reference behind the beginning.
  EXPECT_FALSE(
      refusal("d.pcd", head + bytes<std::uint32_t>(3) + bytes<std::uint32_t>(24) + "\xe0\xff\x01").empty());
}

TEST_F(CloudFiles, PlyInDoublesWithNormals) {
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex 4\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"})
    text += std::string("property double ") + name + "\n";
  text += "property list uint float w\nend_header\n";
  for (const auto& p : kPoints) {
    for (const double x : p) text += bytes(x);
    text += bytes(0.0) + bytes(0.0) + bytes(1.0) + bytes<std::uint32_t>(1) + bytes(2.0F);
  }
  const CloudFile cloud = read("a.ply", text);
  expectPoints(cloud, "double");
  ASSERT_EQ(cloud.normals.cols(), 4);
  EXPECT_EQ(cloud.normals(2, 3), 1.0F);
  EXPECT_NE(
      refusal("u.ply",
              "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\n"
              "property uchar z\nend_header\nabc")
          .find("whole numbers"),
      std::string::npos);
  text.resize(text.size() - 30);
  EXPECT_FALSE(refusal("b.ply", text).empty());
}

TEST_F(CloudFiles, RawFloatsAndDoublesAreToldApart) {
  std::string f32, f64, kitti, noise;
  std::uint32_t state = 1;
  for (int n = 0; n < 400; ++n) {
    for (int axis = 0; axis < 3; ++axis) {
      const double value = 3.0 * std::sin(0.37 * n + axis);
      f32 += bytes(static_cast<float>(value));
      f64 += bytes(value);
      kitti += bytes(static_cast<float>(4.0 * value));
      noise += bytes(state = state * 1664525u + 1013904223u);
    }
    kitti += bytes(0.25F);
  }
  // Doubles of round numbers hold zeros in every second float.
  std::string round;
  for (const auto& p : kPoints) {
    for (const double x : p) round += bytes(0.25 * x);
  }
  const CloudFile quarters = read("r.bin", round);
  ASSERT_EQ(quarters.points.cols(), 4);
  EXPECT_EQ(quarters.points(2, 3), 3.0);
  // A box's corners, some of them off zero by what rounding leaves.
  std::string rounded;
  for (int n = 0; n < 100; ++n)
    rounded += bytes(n % 4 == 0 ? 1e-17 : 0.1 * n) + bytes(0.7) + bytes(-1.3 / (n + 1));
  EXPECT_EQ(read("z.bin", rounded).points.cols(), 100);
  const CloudFile single = read("a.bin", f32), twice = read("b.bin", f64);
  ASSERT_EQ(single.points.cols(), 400);
  ASSERT_EQ(twice.points.cols(), 400);
  EXPECT_LT((single.points - twice.points).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_NE(refusal("c.bin", kitti).find("intensity"), std::string::npos);
  EXPECT_FALSE(refusal("d.bin", noise).empty());
  EXPECT_FALSE(refusal("e.bin", f32 + "x").empty());
}

TEST_F(CloudFiles, TextClouds) {
  const std::string lines = "1 2 3\n4 5 6\n7 -8 9\n-10 11 12\n";
  expectPoints(read("a.xyz", lines), "xyz");
  expectPoints(read("b.csv", "x,y,z,i\n1,2,3,9\n4,5,6,9\n7,-8,9,9\n-10,11,12,9\n"), "csv");
  expectPoints(read("c.pts", "4\n" + lines), "pts");
  expectPoints(read("d.txt", "# comment\n\n" + lines), "txt");
  EXPECT_NE(refusal("e.xyz", lines + "1 2\n").find("line 5"), std::string::npos);
  EXPECT_FALSE(refusal("f.xyz", "nothing\n").empty());
  expectPoints(read("g.xyz", "\xef\xbb\xbf" + lines), "a mark of UTF-8");
  EXPECT_NE(refusal("h.xyz", std::string("\xff\xfe") + lines).find("UTF-16"), std::string::npos);
  EXPECT_NE(refusal("i.xyz", "0,5 1,25 2,0\n").find("decimal points"), std::string::npos);
  EXPECT_NE(refusal("j.csv", "0,5;1,25;2,0\n").find("decimal points"), std::string::npos);
  EXPECT_NE(refusal("k.csv", "x,y,z\n1,,3,4\n").find("line 2"), std::string::npos);
  // .pts files begin with their count.
  EXPECT_NE(refusal("l.pts", "5\n" + lines).find("5 that its first line promises"), std::string::npos);
  EXPECT_NE(refusal("m.pts", "3\n" + lines).find("got 4 points"), std::string::npos);
}

TEST_F(CloudFiles, HeadingsOfAnotherWidthAreRefused) {
  const std::string rows = "0.1,1,2,3\n0.2,4,5,6\n";
  for (const char* heading : {"t,x,y,z,i", "x,y,z"}) {
    const std::string message =
        thrownMessage<std::runtime_error>([&] { read("a.csv", std::string(heading) + "\n" + rows); });
    EXPECT_NE(message.find("got 4 values in line 2 under the heading"), std::string::npos) << message;
  }
}

TEST_F(CloudFiles, HeadingsSayWhereTheCoordinatesAre) {
  const std::string rows = "0,3,2,1,9\n1,6,5,4,9\n2,9,-8,7,9\n3,12,11,-10,9\n";
  for (const char* heading : {"id,z,y,x,i", ",Z,Y,X,I", "\"t\",\"Points:2\",\"Points:1\",\"Points:0\",\"i\"",
                              "//t z[m] y[m] x[m] i", "# stamp z y x intensity"})
    expectPoints(read("a.csv", std::string(heading) + "\n" + rows), heading);
  EXPECT_NE(refusal("b.csv", "lat,lon,height,r,g\n" + rows).find("columns x, y and z"), std::string::npos);
  expectPoints(read("c.xyz", "a room\n# of x y z\n1 2 3 0\n4 5 6 0\n7 -8 9 0\n-10 11 12 0\n"), "title");
  const CloudFile named = read("d.txt", "nx ny nz x y z\n0 0 1 1 2 3\n0 1 0 4 5 6\n");
  ASSERT_EQ(named.normals.cols(), 2);
  EXPECT_EQ(named.points.col(1), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(named.normals.col(1), Eigen::Vector3f(0, 1, 0));
  const CloudFile ending = read("e.xyzn", "1 2 3 0 0 1\n4 5 6 1 0 0\n");
  ASSERT_EQ(ending.normals.cols(), 2);
  EXPECT_EQ(ending.normals.col(1), Eigen::Vector3f(1, 0, 0));
}

TEST_F(CloudFiles, NormalsThatAreMissingAreNotUsed) {
  EXPECT_EQ(read("a.xyzn", "1 2 3 0 0 0\n4 5 6 0 0 0\n").normals.cols(), 0);
  EXPECT_EQ(read("b.xyzn", "1 2 3 nan nan nan\n4 5 6 0 0 1\n").normals.cols(), 0);
  EXPECT_EQ(read("c.xyzn", "1 2 3 0 0 1\n4 5 6 0 0 1\n").normals.cols(), 2);
}

}  // namespace
}  // namespace ttsdf

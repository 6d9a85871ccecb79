#include "ros/messages/cloud_conversion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace ttsdf {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

struct Format {
  std::uint8_t datatype = PointField::FLOAT32;
  std::uint32_t x = 0, y = 4, z = 8, point_step = 12, row_padding = 0;
  bool big_endian = false;
};

void writeNumber(std::uint8_t* target, double value, const Format& format) {
  std::uint8_t raw[8];
  std::size_t size = 8;
  if (format.datatype == PointField::FLOAT32) {
    const auto single = static_cast<float>(value);
    size = 4;
    std::memcpy(raw, &single, size);
  } else {
    std::memcpy(raw, &value, size);
  }
  if (format.big_endian) std::reverse(raw, raw + size);  // the tests run on little-endian machines
  std::memcpy(target, raw, size);
}

PointCloud2 makeCloud(const std::vector<Eigen::Vector3d>& points, std::uint32_t width,
                      const Format& format = {}) {
  PointCloud2 cloud;
  cloud.width = width;
  cloud.height = static_cast<std::uint32_t>(points.size()) / width;
  cloud.point_step = format.point_step;
  cloud.row_step = width * format.point_step + format.row_padding;
  cloud.is_bigendian = format.big_endian;
  const std::pair<const char*, std::uint32_t> fields[] = {{"x", format.x}, {"y", format.y}, {"z", format.z}};
  for (const auto& [name, offset] : fields) {
    PointField field;
    field.name = name;
    field.offset = offset;
    field.datatype = format.datatype;
    field.count = 1;
    cloud.fields.push_back(field);
  }
  cloud.data.assign(std::size_t{cloud.row_step} * cloud.height, 0xAB);
  for (std::size_t n = 0; n < points.size(); ++n) {
    std::uint8_t* point = cloud.data.data() + (n / width) * cloud.row_step + (n % width) * cloud.point_step;
    writeNumber(point + format.x, points[n].x(), format);
    writeNumber(point + format.y, points[n].y(), format);
    writeNumber(point + format.z, points[n].z(), format);
  }
  return cloud;
}

std::vector<Eigen::Vector3d> somePoints(int n) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < n; ++i) points.emplace_back(0.5 + 0.001 * i, -0.25 * (i % 7), 1.0 + 0.125 * (i % 5));
  return points;
}

void expectSame(const ScanPoints& got, const std::vector<Eigen::Vector3d>& wanted) {
  ASSERT_EQ(got.cols(), static_cast<Eigen::Index>(wanted.size()));
  for (std::size_t n = 0; n < wanted.size(); ++n) {
    EXPECT_EQ(got.col(static_cast<Eigen::Index>(n)), wanted[n].cast<float>()) << n;
  }
}

std::string refusal(const PointCloud2& cloud) {
  try {
    convertCloud(cloud, {});
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(ConvertCloud, ReadsEveryLayout) {
  Format padded;  // as PCL writes it
  padded.point_step = 32;
  Format shuffled;
  shuffled.x = 8, shuffled.y = 0, shuffled.z = 4;
  shuffled.row_padding = 5;
  Format unaligned;
  unaligned.x = 1, unaligned.y = 5, unaligned.z = 9;
  unaligned.point_step = 15;
  Format doubles;
  doubles.datatype = PointField::FLOAT64;
  doubles.x = 0, doubles.y = 8, doubles.z = 16;
  doubles.point_step = 27;
  Format big_endian;
  big_endian.big_endian = true;
  Format big_doubles = doubles;
  big_doubles.big_endian = true;
  const auto points = somePoints(24);
  for (const Format& format : {Format(), padded, shuffled, unaligned, doubles, big_endian, big_doubles}) {
    expectSame(convertCloud(makeCloud(points, 24, format), {}).points, points);
    expectSame(convertCloud(makeCloud(points, 6, format), {}).points, points);
  }
}

TEST(ConvertCloud, ReadsPackedRowsWhateverRowStepSays) {
  const auto points = somePoints(24);
  PointCloud2 cloud = makeCloud(points, 6);
  for (const std::size_t row_step : {std::size_t{0}, cloud.data.size()}) {
    cloud.row_step = static_cast<std::uint32_t>(row_step);
    expectSame(convertCloud(cloud, {}).points, points);
    EXPECT_EQ(allPoints(cloud).cols(), 24);
  }
}

TEST(ConvertCloud, AFlagOfTheByteOrderThatLiesIsNotBelieved) {
  Format doubles;
  doubles.datatype = PointField::FLOAT64;
  doubles.x = 0, doubles.y = 8, doubles.z = 16;
  doubles.point_step = 24;
  const auto points = somePoints(200);
  for (const Format& format : {Format(), doubles}) {
    for (const bool big_endian : {false, true}) {
      Format honest = format;
      honest.big_endian = big_endian;
      PointCloud2 cloud = makeCloud(points, 20, honest);
      EXPECT_FALSE(convertCloud(cloud, {}).wrong_byte_order);
      cloud.is_bigendian = !cloud.is_bigendian;
      const ConvertedCloud converted = convertCloud(cloud, {});
      EXPECT_TRUE(converted.wrong_byte_order);
      expectSame(converted.points, points);
    }
  }
}

TEST(ConvertCloud, DropsWhatIsNotFiniteOrOutOfRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const ConvertedCloud converted = convertCloud(makeCloud({{0, 0, 1},
                                                           {nan, 0, 1},
                                                           {0, inf, 1},
                                                           {0, 0, -inf},
                                                           {1e9, 0, 0},
                                                           {1e30, 1e30, 0},
                                                           {0, 0, 0.01},
                                                           {0, 0, 7}},
                                                          8),
                                                {});
  expectSame(converted.points, {{0, 0, 1}});
  EXPECT_EQ(converted.touched, 8);
  EXPECT_EQ(converted.not_finite, 3);
  EXPECT_EQ(converted.out_of_range, 4);
}

TEST(ConvertCloud, TouchesABoundedNumberOfPoints) {
  for (const int max_points : {6, 100, 1000, 5000}) {
    CloudOptions options;
    options.max_points = max_points;
    options.max_range = 1000.0;
    for (const auto& [width, height] :
         {std::pair{640, 480}, {4000, 7}, {7, 4000}, {20000, 1}, {1, 20000}, {3, 2}}) {
      const ConvertedCloud converted = convertCloud(makeCloud(somePoints(width * height), width), options);
      EXPECT_LE(converted.touched, max_points) << width << " x " << height;
      EXPECT_GE(converted.touched, std::min(max_points / 4, width * height)) << width << " x " << height;
    }
  }
}

TEST(ConvertCloud, ThinsAnOrganisedCloudInBothDirections) {
  std::vector<Eigen::Vector3d> points;
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) points.emplace_back(0.001 * u, 0.001 * v, 2.0);
  }
  CloudOptions options;
  options.max_points = 5000;
  const ConvertedCloud converted = convertCloud(makeCloud(points, 640), options);
  EXPECT_EQ(converted.touched, 80 * 60);  // every 8th pixel
  EXPECT_FLOAT_EQ(converted.points(0, 1) - converted.points(0, 0), 0.008f);
  EXPECT_FLOAT_EQ(converted.points(1, 80) - converted.points(1, 0), 0.008f);
}

TEST(ConvertCloud, TakesAnEmptyCloudForNoPoints) {
  EXPECT_EQ(convertCloud(PointCloud2(), {}).points.cols(), 0);
  PointCloud2 cloud = makeCloud(somePoints(4), 4);
  cloud.width = 0;
  cloud.data.clear();
  EXPECT_EQ(convertCloud(cloud, {}).points.cols(), 0);
}

TEST(ConvertCloud, RefusesWhatItCannotRead) {
  const PointCloud2 good = makeCloud(somePoints(12), 4);
  PointCloud2 cloud = good;
  cloud.fields.erase(cloud.fields.begin() + 2);
  EXPECT_TRUE(contains(refusal(cloud), "no field 'z'; got fields 'x y'"));
  cloud = good;
  cloud.fields[1].datatype = PointField::INT16;
  EXPECT_TRUE(contains(refusal(cloud), "differ in datatype"));
  cloud = good;
  for (auto& field : cloud.fields) field.datatype = PointField::INT32;
  EXPECT_TRUE(contains(refusal(cloud), "datatype 5, wanted float32"));
  cloud = good;
  cloud.fields[2].offset = 9;
  EXPECT_TRUE(contains(refusal(cloud), "ends at byte 13 of a point of 12 bytes"));
  cloud = good;
  cloud.data.pop_back();
  EXPECT_TRUE(contains(refusal(cloud), "got 143 bytes of data, wanted 144"));
  cloud = good;
  cloud.row_step = 47;
  EXPECT_TRUE(contains(refusal(cloud), "row_step 47"));
  cloud = good;
  cloud.point_step = 0;
  EXPECT_TRUE(contains(refusal(cloud), "of a point of 0 bytes"));
  cloud = good;
  cloud.fields[0].offset = 0xFFFFFFFF;
  EXPECT_TRUE(contains(refusal(cloud), "ends at byte"));
  cloud = good;
  cloud.width = cloud.height = cloud.point_step = cloud.row_step = 0xFFFFFFFF;
  EXPECT_NE(refusal(cloud), "accepted");
}

TEST(ToCloudMessage, IsReadBackTheSame) {
  const auto points = somePoints(50);
  ScanPoints scan(3, 50);
  for (Eigen::Index n = 0; n < 50; ++n) scan.col(n) = points[static_cast<std::size_t>(n)].cast<float>();
  std_msgs::Header header;
  header.frame_id = "map";
  const PointCloud2 message = toCloudMessage(scan, header);
  EXPECT_EQ(message.header.frame_id, "map");
  expectSame(convertCloud(message, {}).points, points);
  EXPECT_EQ(toCloudMessage(ScanPoints(3, 0), header).width, 0u);
}

}  // namespace
}  // namespace ttsdf

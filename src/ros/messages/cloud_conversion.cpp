#include "ros/messages/cloud_conversion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

namespace ttsdf {

namespace {
constexpr int kPointsLookedAt = 300;  // to find out about the byte order
constexpr double kNonsense = 0.6, kSense = 0.95;

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

[[noreturn]] void throwInvalid(const std::string& what) { throw std::invalid_argument("cloud: " + what); }

const PointField& findField(const PointCloud2& cloud, const std::string& name) {
  std::string names;
  const PointField* found = nullptr;
  for (const PointField& field : cloud.fields) {
    names += (names.empty() ? "" : " ") + field.name;
    if (field.name != name) continue;
    if (found && (found->offset != field.offset || found->datatype != field.datatype)) {
      throwInvalid("two fields '" + name + "', at the bytes " + std::to_string(found->offset) + " and " +
                   std::to_string(field.offset) + " of a point, wanted one");
    }
    found = &field;
  }
  if (found) return *found;
  throwInvalid("no field '" + name + "'; got fields '" + names + "', wanted x, y, z");
}

/// Where x, y, z stand in a point; checked against the size of the data.
struct Layout {
  std::array<std::size_t, 3> offset;
  std::uint8_t datatype;
  std::uint64_t point_step, row_step;  // products of them do not fit 32 bits
  bool swap;
};

Layout checkedLayout(const PointCloud2& cloud) {
  Layout layout{};
  layout.point_step = cloud.point_step;
  layout.row_step = cloud.height > 1 ? cloud.row_step : std::uint64_t{cloud.width} * cloud.point_step;
  layout.swap = (cloud.is_bigendian != 0) != hostIsBigEndian();
  layout.datatype = findField(cloud, "x").datatype;
  if (layout.datatype != PointField::FLOAT32 && layout.datatype != PointField::FLOAT64) {
    throwInvalid("field 'x' has datatype " + std::to_string(layout.datatype) +
                 ", wanted float32 (7) or float64 (8)");
  }
  const std::size_t size = layout.datatype == PointField::FLOAT32 ? 4 : 8;
  const std::array<const char*, 3> names{{"x", "y", "z"}};
  for (std::size_t n = 0; n < 3; ++n) {
    const PointField& field = findField(cloud, names[n]);
    if (field.datatype != layout.datatype) {
      throwInvalid(std::string("fields 'x' and '") + names[n] + "' differ in datatype: " +
                   std::to_string(layout.datatype) + " and " + std::to_string(field.datatype));
    }
    if (std::uint64_t{field.offset} + size > layout.point_step) {
      throwInvalid(std::string("field '") + names[n] + "' ends at byte " +
                   std::to_string(std::uint64_t{field.offset} + size) + " of a point of " +
                   std::to_string(layout.point_step) + " bytes");
    }
    layout.offset[n] = field.offset;
    for (std::size_t m = 0; m < n; ++m) {
      if (std::max(layout.offset[m], layout.offset[n]) - std::min(layout.offset[m], layout.offset[n]) <
          size) {
        throwInvalid(std::string("fields '") + names[m] + "' and '" + names[n] + "' overlap: got the bytes " +
                     std::to_string(layout.offset[m]) + " and " + std::to_string(layout.offset[n]) +
                     " of a point, wanted them " + std::to_string(size) + " apart");
      }
    }
  }
  // Real drivers leave row_step 0, or put the size of the whole cloud there: their data are packed.
  const std::uint64_t packed = std::uint64_t{cloud.width} * layout.point_step;
  const auto needed = [&] { return (std::uint64_t{cloud.height} - 1) * layout.row_step + packed; };
  const bool fits = layout.row_step >= packed && cloud.data.size() >= needed();
  const bool odd = layout.row_step == 0 || layout.row_step == cloud.data.size();
  if (!fits && odd && cloud.data.size() / cloud.height == packed && cloud.data.size() % cloud.height == 0)
    layout.row_step = packed;
  if (layout.row_step < packed) {
    throwInvalid("row_step " + std::to_string(layout.row_step) +
                 " is less than width x point_step = " + std::to_string(packed));
  }
  if (cloud.data.size() < needed())
    throwInvalid("got " + std::to_string(cloud.data.size()) + " bytes of data, wanted " +
                 std::to_string(needed()));
  return layout;
}

template <class Number>
float readNumber(const std::uint8_t* bytes, bool swap) {
  std::uint8_t raw[sizeof(Number)];
  std::memcpy(raw, bytes, sizeof(Number));  // the point may not be aligned
  if (swap) std::reverse(raw, raw + sizeof(Number));
  Number number;
  std::memcpy(&number, raw, sizeof(Number));
  return static_cast<float>(number);
}

template <class Number>
void readPoints(const PointCloud2& cloud, const Layout& layout, const CloudOptions& options,
                ConvertedCloud& result) {
  const Stride stride = chooseStride(cloud.width, cloud.height, options.max_points);
  PointFilter filter(options, result);
  for (std::size_t row = 0; row < cloud.height; row += stride.row) {
    const std::uint8_t* point = cloud.data.data() + row * layout.row_step;
    for (std::size_t column = 0; column < cloud.width; column += stride.column) {
      const std::uint8_t* bytes = point + column * layout.point_step;
      filter.add(readNumber<Number>(bytes + layout.offset[0], layout.swap),
                 readNumber<Number>(bytes + layout.offset[1], layout.swap),
                 readNumber<Number>(bytes + layout.offset[2], layout.swap));
    }
  }
}

/// Share of numbers that could be metres of a sensor, of those that are any: a float read backwards is mostly
/// 1e-40 or 1e30.
template <class Number>
double plausibleShare(const PointCloud2& cloud, const Layout& layout, bool swap) {
  const Stride stride = chooseStride(cloud.width, cloud.height, kPointsLookedAt);
  int numbers = 0, plausible = 0;
  for (std::size_t row = 0; row < cloud.height; row += stride.row) {
    const std::uint8_t* point = cloud.data.data() + row * layout.row_step;
    for (std::size_t column = 0; column < cloud.width; column += stride.column) {
      for (const std::size_t offset : layout.offset) {
        const float value = readNumber<Number>(point + column * layout.point_step + offset, swap);
        if (!std::isfinite(value) || value == 0.0F) continue;
        ++numbers;
        plausible += std::abs(value) > 1e-6F && std::abs(value) < 1e6F;
      }
    }
  }
  return numbers == 0 ? 1.0 : static_cast<double>(plausible) / numbers;
}

/// True if the flag of the byte order lies.
bool correctByteOrder(const PointCloud2& cloud, Layout& layout) {
  const auto share = [&](bool swap) {
    return layout.datatype == PointField::FLOAT32 ? plausibleShare<float>(cloud, layout, swap)
                                                  : plausibleShare<double>(cloud, layout, swap);
  };
  if (share(layout.swap) > kNonsense || share(!layout.swap) < kSense) return false;
  layout.swap = !layout.swap;
  return true;
}

template <class Number>
ScanPoints readAll(const PointCloud2& cloud, const Layout& layout) {
  ScanPoints points(3, static_cast<Eigen::Index>(cloud.width) * static_cast<Eigen::Index>(cloud.height));
  Eigen::Index n = 0;
  for (std::size_t row = 0; row < cloud.height; ++row) {
    const std::uint8_t* bytes = cloud.data.data() + row * layout.row_step;
    for (std::size_t column = 0; column < cloud.width; ++column, bytes += layout.point_step, ++n) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        points(axis, n) =
            readNumber<Number>(bytes + layout.offset[static_cast<std::size_t>(axis)], layout.swap);
      }
    }
  }
  return points;
}

}  // namespace

bool hostIsBigEndian() {
  const std::uint16_t one = 1;
  std::uint8_t first;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

Stride chooseStride(std::size_t width, std::size_t height, int max_points) {
  const auto limit = static_cast<std::size_t>(max_points);
  const auto kept = [](std::size_t n, std::size_t step) { return (n + step - 1) / step; };
  Stride stride;
  if (height > 1) {
    const double share =
        static_cast<double>(width) * static_cast<double>(height) / static_cast<double>(limit);
    stride.row = stride.column =
        std::max<std::size_t>(1, static_cast<std::size_t>(std::floor(std::sqrt(share))));
    while (kept(height, stride.row) * kept(width, stride.column) > limit) {
      // The shorter side ends at one row; then only the longer one can be thinned.
      if (stride.row < height) ++stride.row;
      if (stride.column < width) ++stride.column;
    }
  } else {
    stride.column = std::max<std::size_t>(1, kept(width, limit));
  }
  return stride;
}

PointFilter::PointFilter(const CloudOptions& options, ConvertedCloud& result)
    : min_squared_(static_cast<float>(options.min_range * options.min_range)),
      max_squared_(static_cast<float>(options.max_range * options.max_range)),
      result_(result) {
  result_.points.resize(Eigen::NoChange, options.max_points);
}

PointFilter::~PointFilter() { result_.points.conservativeResize(Eigen::NoChange, kept_); }

void PointFilter::add(float x, float y, float z) {
  ++result_.touched;
  const float squared = x * x + y * y + z * z;
  if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) {
    ++result_.not_finite;
  } else if (!(squared >= min_squared_ && squared <= max_squared_)) {  // 1e30 squared is inf: out of range
    ++result_.out_of_range;
  } else {
    result_.points.col(kept_++) << x, y, z;
  }
}

const OptionTable<CloudOptions>& cloudOptionTable() {
  using O = CloudOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("min_range", &O::min_range, 0.0, 1000.0, "m", "Nearer points are dropped.")
          .add("max_range", &O::max_range, 0.0, 1000.0, "m",
               "Farther points are dropped; distance from the sensor, before any transform.")
          .add("max_points", &O::max_points, 6, 10000000, "",
               "Points looked at per cloud; a larger cloud is sub-sampled first, an organised one by rows "
               "and columns.");
  return table;
}

ConvertedCloud convertCloud(const PointCloud2& cloud, const CloudOptions& options) {
  ConvertedCloud result;
  if (cloud.width == 0 || cloud.height == 0) return result;
  Layout layout = checkedLayout(cloud);
  result.wrong_byte_order = correctByteOrder(cloud, layout);
  if (layout.datatype == PointField::FLOAT32) {
    readPoints<float>(cloud, layout, options, result);
  } else {
    readPoints<double>(cloud, layout, options, result);
  }
  return result;
}

ScanPoints allPoints(const PointCloud2& cloud) {
  if (cloud.width == 0 || cloud.height == 0) return {};
  Layout layout = checkedLayout(cloud);
  correctByteOrder(cloud, layout);
  return layout.datatype == PointField::FLOAT32 ? readAll<float>(cloud, layout)
                                                : readAll<double>(cloud, layout);
}

PointCloud2 toCloudMessage(const ScanPoints& points, const std_msgs::Header& header) {
  PointCloud2 cloud;
  cloud.header = header;
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(points.cols());
  const std::array<const char*, 3> names{{"x", "y", "z"}};
  for (std::uint32_t n = 0; n < 3; ++n) {
    PointField field;
    field.name = names[n];
    field.offset = 4 * n;
    field.datatype = PointField::FLOAT32;
    field.count = 1;
    cloud.fields.push_back(field);
  }
  cloud.is_bigendian = hostIsBigEndian();
  cloud.point_step = 12;
  cloud.row_step = 12 * cloud.width;
  cloud.is_dense = true;
  cloud.data.resize(cloud.row_step);
  if (points.cols() > 0) std::memcpy(cloud.data.data(), points.data(), cloud.data.size());
  return cloud;
}

}  // namespace ttsdf

// PCD, version 0.7 and before: ascii, binary, binary_compressed.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "cloud_formats.h"

namespace ttsdf {

namespace {

struct Field {
  std::string name;
  char type = 'F';
  std::int64_t size = 4, count = 1;
  std::size_t offset = 0;  // [byte] in a point, or [word] in a line of text
};

struct Header {
  std::vector<Field> fields;
  std::int64_t width = -1, height = 1, points = -1;
  std::size_t point_bytes = 0, point_words = 0;
  std::optional<Eigen::Isometry3d> viewpoint;
  std::string data;

  const Field* find(const std::string& name) const {
    for (const Field& field : fields) {
      if (field.name == name) return &field;
    }
    return nullptr;
  }
};

constexpr std::int64_t kMostPoints = 4000000000;  // whose product with a point's size still fits
constexpr std::int64_t kMostWords = 100000;       // of a point

class HeaderReader {
 public:
  explicit HeaderReader(const FileBytes& file) : file_(file), cursor_(file.text()) {}

  Header read() {
    while (header_.data.empty()) {
      if (cursor_.atEnd()) file_.fail("got no PCD header that ends with a DATA line");
      parseLine(cursor_.line());
    }
    layOut();
    return header_;
  }
  const char* data() const { return cursor_.position(); }

 private:
  void parseLine(std::string_view line) {
    WordCursor words(line.data(), line.data() + line.size());
    const std::string key(words.nextInLine());
    if (key.empty() || key[0] == '#' || key == "VERSION") return;
    std::vector<std::string> values;
    for (std::string_view word = words.nextInLine(); !word.empty(); word = words.nextInLine())
      values.emplace_back(word);
    if (key == "FIELDS" || key == "COLUMNS") {
      for (const std::string& name : values) {
        header_.fields.emplace_back();
        header_.fields.back().name = name;
      }
      if (values.empty()) file_.fail("got no name in its FIELDS line");
    } else if (key == "SIZE" || key == "COUNT" || key == "TYPE") {
      parsePerField(key, values);
    } else if (key == "WIDTH") {
      header_.width = number(key, values);
    } else if (key == "HEIGHT") {
      header_.height = number(key, values);
    } else if (key == "POINTS") {
      header_.points = number(key, values);
    } else if (key == "VIEWPOINT") {
      parseViewpoint(values);
    } else if (key == "DATA") {
      header_.data = values.empty() ? "" : values[0];
      if (header_.data != "ascii" && header_.data != "binary" && header_.data != "binary_compressed") {
        file_.fail("got DATA '" + shown(header_.data) + "', wanted ascii, binary or binary_compressed");
      }
    } else {
      file_.fail("got the header line '" + shown(line) +
                 "', wanted a PCD header (FIELDS, SIZE, TYPE, WIDTH, ... DATA)");
    }
  }

  std::int64_t number(const std::string& key, const std::vector<std::string>& values) const {
    std::int64_t value = -1;
    if (values.size() != 1 || !parseNumber(std::string_view(values[0]), &value) || value < 0 ||
        value > kMostPoints) {
      file_.fail("got " + key + " '" + (values.empty() ? "" : shown(values[0])) +
                 "', wanted one number from 0 to " + std::to_string(kMostPoints));
    }
    return value;
  }

  void parsePerField(const std::string& key, const std::vector<std::string>& values) {
    if (values.size() != header_.fields.size() || values.empty()) {
      file_.fail("got " + std::to_string(values.size()) + " values in its " + key +
                 " line, wanted one for each of " + std::to_string(header_.fields.size()) + " fields");
    }
    for (std::size_t n = 0; n < values.size(); ++n) {
      Field& field = header_.fields[n];
      if (key == "TYPE") {
        field.type = values[n].size() == 1 ? values[n][0] : '?';
        continue;
      }
      std::int64_t& target = key == "SIZE" ? field.size : field.count;
      if (!parseNumber(std::string_view(values[n]), &target) || target < (key == "SIZE" ? 1 : 0) ||
          target > kMostWords) {
        file_.fail("got " + key + " '" + shown(values[n]) + "' of field '" + shown(field.name) +
                   "', wanted 1, 2, 4, ...");
      }
    }
  }

  void parseViewpoint(const std::vector<std::string>& values) {
    double v[7];
    bool good = values.size() == 7;
    for (std::size_t n = 0; good && n < 7; ++n)
      good = parseNumber(std::string_view(values[n]), &v[n]) && std::isfinite(v[n]);
    const Eigen::Quaterniond q(good ? v[3] : 0.0, good ? v[4] : 0.0, good ? v[5] : 0.0, good ? v[6] : 0.0);
    if (!good || std::abs(q.norm() - 1.0) > 0.01) return;  // nobody needs it: old files have zeros
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = Eigen::Vector3d(v[0], v[1], v[2]);
    T.linear() = q.normalized().toRotationMatrix();
    if (!T.matrix().isIdentity(1e-12)) header_.viewpoint = T;
  }

  void layOut() {
    if (header_.fields.empty()) file_.fail("got no FIELDS line");
    for (Field& field : header_.fields) {
      const bool real = field.type == 'F' && (field.size == 4 || field.size == 8);
      const bool whole = (field.type == 'I' || field.type == 'U') &&
                         (field.size == 1 || field.size == 2 || field.size == 4 || field.size == 8);
      if (!real && !whole) {
        file_.fail("got field '" + shown(field.name) + "' of type " + shown(std::string(1, field.type)) +
                   " and " + std::to_string(field.size) +
                   " bytes, wanted F of 4 or 8, I or U of 1, 2, 4 or 8");
      }
      field.offset = header_.data == "ascii" ? header_.point_words : header_.point_bytes;
      header_.point_bytes += static_cast<std::size_t>(field.size * field.count);
      header_.point_words += static_cast<std::size_t>(field.count);
    }
    const double area = header_.width >= 0
                            ? static_cast<double>(header_.width) * static_cast<double>(header_.height)
                            : static_cast<double>(header_.points);
    if (header_.points < 0)
      header_.points = area <= static_cast<double>(kMostPoints) ? static_cast<std::int64_t>(area) : -1;
    if (header_.points < 0 || static_cast<double>(header_.points) != area) {
      file_.fail("got WIDTH " + std::to_string(header_.width) + ", HEIGHT " + std::to_string(header_.height) +
                 " and POINTS " + std::to_string(header_.points) + ", wanted POINTS = WIDTH x HEIGHT");
    }
  }

  const FileBytes& file_;
  WordCursor cursor_;
  Header header_;
};

double valueAt(const Field& field, const char* bytes) {
  const auto as = [bytes](auto value) {
    std::memcpy(&value, bytes, sizeof(value));
    return static_cast<double>(value);
  };
  if (field.type == 'F') return field.size == 4 ? as(float()) : as(double());
  const bool sign = field.type == 'I';
  switch (field.size) {
    case 1:
      return sign ? as(std::int8_t()) : as(std::uint8_t());
    case 2:
      return sign ? as(std::int16_t()) : as(std::uint16_t());
    case 4:
      return sign ? as(std::int32_t()) : as(std::uint32_t());
    default:
      return sign ? as(std::int64_t()) : as(std::uint64_t());
  }
}

/// The fields that are wanted: x y z and, if all are there, the normal.
std::vector<const Field*> wantedFields(const FileBytes& file, const Header& header) {
  std::vector<const Field*> fields;
  for (const char* name : {"x", "y", "z"}) {
    fields.push_back(header.find(name));
    const auto same = std::count_if(header.fields.begin(), header.fields.end(),
                                    [name](const Field& field) { return field.name == name; });
    if (same > 1)
      file.fail(std::string("got the field '") + name + "' " + std::to_string(same) +
                " times, wanted it once");
    if (!fields.back() || fields.back()->count < 1) {
      file.fail(std::string("got no field '") + name + "', wanted x, y and z");
    }
  }
  for (const char* name : {"normal_x", "normal_y", "normal_z"}) {
    const Field* field = header.find(name);
    if (!field || field->count < 1) {
      fields.resize(3);
      break;
    }
    fields.push_back(field);
  }
  return fields;
}

void put(CloudFile& cloud, std::size_t f, Eigen::Index n, double value) {
  if (f < 3) {
    cloud.points(static_cast<Eigen::Index>(f), n) = value;
  } else {
    cloud.normals(static_cast<Eigen::Index>(f - 3), n) = static_cast<float>(value);
  }
}

void readText(const FileBytes& file, const Header& header, const char* data,
              const std::vector<const Field*>& fields, CloudFile& cloud) {
  WordCursor cursor(data, file.end());
  std::vector<std::string_view> words(header.point_words);
  for (std::int64_t n = 0; n < header.points; ++n) {
    const std::string place = "point " + std::to_string(n) + " of " + std::to_string(header.points);
    for (std::size_t w = 0; w < words.size(); ++w) {
      words[w] = w == 0 ? cursor.next() : cursor.nextInLine();
      if (words[w].empty()) {
        file.fail(cursor.atEnd() ? "is truncated: got its end in " + place
                                 : "got " + std::to_string(w) + " values in " + place + ", wanted " +
                                       std::to_string(words.size()));
      }
    }
    if (!cursor.nextInLine().empty()) {
      file.fail("got more than " + std::to_string(words.size()) + " values in the line of " + place);
    }
    for (std::size_t f = 0; f < fields.size(); ++f) {
      double value = 0.0;
      if (!parseNumber(words[fields[f]->offset], &value)) {
        file.fail("got '" + shown(words[fields[f]->offset]) + "' in " + place + ", wanted a number");
      }
      put(cloud, f, static_cast<Eigen::Index>(n), value);
    }
  }
  cursor.skipBlank();
  if (!cursor.atEnd())
    file.fail("got more points than the " + std::to_string(header.points) + " of its header");
}

/// Where a field's value of a point is: beside the others of the point, or field by field (compressed files).
void readBytes(const Header& header, const char* bytes, bool by_field,
               const std::vector<const Field*>& fields, CloudFile& cloud) {
  const auto points = static_cast<std::size_t>(header.points);
  for (std::size_t f = 0; f < fields.size(); ++f) {
    const Field& field = *fields[f];
    const char* first = bytes + (by_field ? field.offset * points : field.offset);
    const std::size_t step =
        by_field ? static_cast<std::size_t>(field.size * field.count) : header.point_bytes;
    for (std::size_t n = 0; n < points; ++n)
      put(cloud, f, static_cast<Eigen::Index>(n), valueAt(field, first + n * step));
  }
}

/// Data behind what the header promises: points would be lost. Some writers fill up with zeros.
void refuseMore(const FileBytes& file, const char* rest, const Header& header) {
  const auto blank = [](char c) { return c == 0 || c == '\n' || c == '\r' || c == ' '; };
  if (std::all_of(rest, file.end(), blank)) return;
  file.fail("got " + std::to_string(file.end() - rest) + " bytes more than the " +
            std::to_string(header.points) + " points of " + std::to_string(header.point_bytes) +
            " bytes that its header promises");
}

std::vector<char> expanded(const FileBytes& file, const char* data, std::size_t wanted) {
  std::uint32_t sizes[2] = {0, 0};
  if (file.end() - data < 8) file.fail("is truncated: got no sizes of the compressed data");
  std::memcpy(sizes, data, sizeof(sizes));
  const auto left = static_cast<std::size_t>(file.end() - data) - sizeof(sizes);
  if (sizes[0] > left) {
    file.fail("is truncated: got " + std::to_string(left) + " bytes of compressed data, wanted " +
              std::to_string(sizes[0]));
  }
  if (sizes[1] != wanted) {
    file.fail("got " + std::to_string(sizes[1]) + " bytes behind the compression, wanted " +
              std::to_string(wanted) + " for the points of its header");
  }
  constexpr double kBestRatio = 100.0;  // LZF makes 264 bytes of three at the best
  if (static_cast<double>(wanted) > kBestRatio * (static_cast<double>(sizes[0]) + 3.0)) {
    file.fail("got " + std::to_string(sizes[0]) + " bytes that cannot expand to " + std::to_string(wanted));
  }
  std::vector<char> bytes(wanted);
  if (!expandLzf(reinterpret_cast<const unsigned char*>(data) + sizeof(sizes), sizes[0],
                 reinterpret_cast<unsigned char*>(bytes.data()), wanted)) {
    file.fail("got compressed data that are damaged");
  }
  return bytes;
}

}  // namespace

bool expandLzf(const unsigned char* in, std::size_t in_size, unsigned char* out, std::size_t size) {
  std::size_t i = 0, o = 0;
  while (i < in_size) {
    const unsigned control = in[i++];
    if (control < 32) {  // control + 1 bytes as they are
      const std::size_t length = control + 1;
      if (in_size - i < length || size - o < length) return false;
      std::memcpy(out + o, in + i, length);
      i += length, o += length;
      continue;
    }
    std::size_t length = control >> 5;
    if (length == 7) {
      if (i >= in_size) return false;
      length += in[i++];
    }
    length += 2;
    if (i >= in_size) return false;
    const std::size_t back = ((control & 0x1fu) << 8) + in[i++] + 1;
    if (back > o || size - o < length) return false;
    for (std::size_t n = 0; n < length; ++n, ++o) out[o] = out[o - back];  // they may overlap
  }
  return o == size;
}

CloudFile readPcd(const FileBytes& file) {
  HeaderReader reader(file);
  const Header header = reader.read();
  const std::vector<const Field*> fields = wantedFields(file, header);
  const auto left = static_cast<double>(file.end() - reader.data());
  const double wanted = static_cast<double>(header.points) * static_cast<double>(header.point_bytes);
  const double fewest =
      header.data == "ascii"
          ? 2.0 * static_cast<double>(header.points) * static_cast<double>(header.point_words) - 1.0
      : header.data == "binary" ? wanted
                                : 0.0;
  if (fewest > left) {
    file.fail("is truncated: its header promises " + std::to_string(header.points) + " points of " +
              std::to_string(header.point_bytes) + " bytes, got " +
              std::to_string(static_cast<long long>(left)) + " bytes of data");
  }
  if (header.data == "binary") refuseMore(file, reader.data() + static_cast<std::ptrdiff_t>(wanted), header);
  std::vector<char> bytes;
  if (header.data == "binary_compressed" && wanted > 0.0) {
    if (wanted > 4294967295.0) file.fail("got more data than a compressed PCD file can hold");
    bytes = expanded(file, reader.data(), static_cast<std::size_t>(wanted));
  }
  CloudFile cloud;
  cloud.T_points_sensor = header.viewpoint;
  cloud.points.resize(3, static_cast<Eigen::Index>(header.points));
  cloud.normals.resize(3, fields.size() > 3 ? static_cast<Eigen::Index>(header.points) : 0);
  cloud.whole_numbers = fields[0]->type != 'F' || fields[1]->type != 'F' || fields[2]->type != 'F';
  if (header.points == 0) return cloud;
  if (header.data == "ascii") {
    readText(file, header, reader.data(), fields, cloud);
  } else {
    readBytes(header, bytes.empty() ? reader.data() : bytes.data(), !bytes.empty(), fields, cloud);
  }
  return cloud;
}

}  // namespace ttsdf

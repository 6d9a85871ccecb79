// What PLY, OFF, OBJ and STL say of vertices and faces.

#include <algorithm>
#include <cmath>
#include <cstring>

#include "ply_file.h"
#include "triangle_soup.h"

namespace ttsdf {

namespace {

std::int64_t asIndex(const FileBytes& file, double value) {
  if (!(std::abs(value) < 9e15) || value != std::floor(value)) {
    file.fail("got " + std::to_string(value) + " as the index of a vertex, wanted a whole number");
  }
  return static_cast<std::int64_t>(value);
}

int facesProperty(const FileBytes& file, const PlyElement& element) {
  for (const char* name : {"vertex_indices", "vertex_index"}) {
    const int p = element.find(name);
    if (p >= 0 && element.properties[static_cast<std::size_t>(p)].list) return p;
  }
  if (element.count > 0) {
    file.fail("got element '" + element.name + "' without a list vertex_indices (or vertex_index)");
  }
  return -1;
}

}  // namespace

void readPlyTriangles(const FileBytes& file, TriangleSoup& soup) {
  const PlyFile ply(file);
  const PlyElement* vertex = ply.find("vertex");
  if (!vertex) file.fail("got no element 'vertex'");
  int xyz[3];
  for (int axis = 0; axis < 3; ++axis) {
    xyz[axis] = vertex->find(std::string(1, static_cast<char>('x' + axis)));
    if (xyz[axis] < 0 || vertex->properties[static_cast<std::size_t>(xyz[axis])].list) {
      file.fail("got vertices without x, y and z");
    }
  }
  std::vector<std::int64_t> corners;
  const PlyElement* current = nullptr;
  int list = -1;
  ply.read([&](const PlyElement& element, const PlyItem& item) {
    if (&element == vertex) {
      soup.addVertex(item.scalars[static_cast<std::size_t>(xyz[0])],
                     item.scalars[static_cast<std::size_t>(xyz[1])],
                     item.scalars[static_cast<std::size_t>(xyz[2])]);
      return;
    }
    const bool strips = element.name == "tristrips";
    if (element.name != "face" && !strips) return;
    if (&element != current) {
      current = &element;
      list = facesProperty(file, element);
    }
    corners.clear();
    for (const double index : item.lists[static_cast<std::size_t>(list)])
      corners.push_back(asIndex(file, index));
    strips ? soup.addStrip(corners) : soup.addPolygon(corners);
  });
}

// ---- OFF: line by line, comments from '#' on; what follows the coordinates (colours, normals) is skipped
// ----

namespace {

/// Words of the next line that holds any.
WordCursor nextOffLine(const FileBytes& file, WordCursor& cursor, const std::string& wanted) {
  cursor.skipBlank('#');
  if (cursor.atEnd()) file.fail("is truncated: got its end, wanted " + wanted);
  const std::string_view line = cursor.line();
  const std::string_view text = line.substr(0, line.find('#'));
  return {text.data(), text.data() + text.size()};
}

std::int64_t offCount(const FileBytes& file, WordCursor& words) {
  std::int64_t count = -1;
  const std::string_view word = words.next();
  if (!parseNumber(word, &count) || count < 0) {
    file.fail("got '" + shown(word) + "' in the OFF header, wanted the numbers of vertices and faces");
  }
  return count;
}

}  // namespace

void readOffTriangles(const FileBytes& file, TriangleSoup& soup) {
  WordCursor cursor = file.text();
  WordCursor header = nextOffLine(file, cursor, "an OFF header");
  const std::string_view magic = header.next();
  const std::size_t end = magic.find("OFF");
  static const std::vector<std::string_view> kKinds = {"", "C", "N", "CN", "NC", "ST", "STC", "STN", "STCN"};
  if (end == std::string_view::npos ||
      std::find(kKinds.begin(), kKinds.end(), magic.substr(0, end)) == kKinds.end()) {
    file.fail("got '" + shown(magic) + "' in the first line, wanted OFF");
  }
  if (end + 3 < magic.size()) {  // "OFF490 518 0", as ModelNet has it
    header = WordCursor(magic.data() + end + 3, header.position() + header.remaining());
  } else {
    header.skipBlank();
    if (header.atEnd()) header = nextOffLine(file, cursor, "the numbers of vertices and faces");
  }
  if (!header.atEnd() && *header.position() == 'B') file.fail("is a binary OFF file, wanted a text");
  const std::int64_t vertices = offCount(file, header), faces = offCount(file, header);
  if (static_cast<double>(vertices) + static_cast<double>(faces) >
      static_cast<double>(cursor.remaining()) / 2.0 + 1.0) {
    file.fail("is truncated: its header promises " + std::to_string(vertices) + " vertices and " +
              std::to_string(faces) + " faces in " + std::to_string(file.size()) + " bytes");
  }
  for (std::int64_t n = 0; n < vertices; ++n) {
    const std::string place = "vertex " + std::to_string(n) + " of " + std::to_string(vertices);
    WordCursor words = nextOffLine(file, cursor, place);
    double p[3];
    for (double& x : p) {
      const std::string_view word = words.next();
      if (!parseNumber(word, &x)) file.fail("got '" + shown(word) + "' in " + place + ", wanted x y z");
    }
    soup.addVertex(p[0], p[1], p[2]);
  }
  std::vector<std::int64_t> corners;
  for (std::int64_t n = 0; n < faces; ++n) {
    const std::string place = "face " + std::to_string(n) + " of " + std::to_string(faces);
    WordCursor words = nextOffLine(file, cursor, place);
    const std::int64_t count = offCount(file, words);
    corners.clear();
    for (std::int64_t c = 0; c < count; ++c) {
      std::int64_t corner = -1;
      const std::string_view word = words.next();
      if (!parseNumber(word, &corner)) {
        file.fail("got '" + shown(word) + "' in " + place + ", wanted " + std::to_string(count) +
                  " indices of vertices");
      }
      corners.push_back(corner);
    }
    soup.addPolygon(corners);
  }
  cursor.skipBlank('#');
  if (!cursor.atEnd()) file.fail("got more data than its header promises");
}

// ---- OBJ ----

namespace {

void readObjVertex(const FileBytes& file, WordCursor& words, const std::string& place, TriangleSoup& soup) {
  double v[7];
  int count = 0;
  for (std::string_view word = words.next(); !word.empty() && count < 7; word = words.next()) {
    if (!parseNumber(word, &v[count++]))
      file.fail("got '" + shown(word) + "' in " + place + ", wanted numbers");
  }
  if (count < 3) file.fail("got " + std::to_string(count) + " numbers in " + place + ", wanted x y z");
  // Four numbers are x y z w, six or seven a colour besides.
  const double w = count == 4 ? v[3] : 1.0;
  soup.addVertex(v[0] / w, v[1] / w, v[2] / w);
}

void readObjFace(const FileBytes& file, WordCursor& words, const std::string& place, TriangleSoup& soup) {
  std::vector<std::int64_t> corners;
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    std::int64_t index = 0;
    if (!parseNumber(word.substr(0, word.find('/')), &index) || index == 0) {
      file.fail("got '" + shown(word) + "' in " + place +
                ", wanted indices of vertices (1, 2, ... or -1, -2, ...)");
    }
    const std::int64_t corner = index > 0 ? index - 1 : static_cast<std::int64_t>(soup.vertexCount()) + index;
    if (corner < 0) {
      file.fail("got vertex index " + std::to_string(index) + " in " + place + ", wanted one of the " +
                std::to_string(soup.vertexCount()) + " vertices before");
    }
    corners.push_back(corner);
  }
  if (corners.size() < 3) {
    file.fail("got a face of " + std::to_string(corners.size()) + " corners in " + place +
              ", wanted three or more");
  }
  soup.addPolygon(corners);
}

}  // namespace

void readObjTriangles(const FileBytes& file, TriangleSoup& soup) {
  WordCursor cursor = file.text();
  std::string joined;  // of lines that a backslash continues
  while (!cursor.atEnd()) {
    const std::string place = "line " + std::to_string(cursor.lineNumber());
    std::string_view line = cursor.line();
    if (!line.empty() && line.back() == '\\') {
      joined.clear();
      while (!line.empty() && line.back() == '\\') {
        joined.append(line.substr(0, line.size() - 1)) += ' ';
        line = cursor.line();
      }
      joined.append(line);
      line = joined;
    }
    if (line.find('\0') != std::string_view::npos) file.fail("got bytes that are no text in " + place);
    line = line.substr(0, line.find('#'));
    WordCursor words(line.data(), line.data() + line.size());
    const std::string_view keyword = words.next();
    if (keyword == "v") {
      readObjVertex(file, words, place, soup);
    } else if (keyword == "f" || keyword == "fo") {
      readObjFace(file, words, place, soup);
    } else if (keyword == "surf" || keyword == "curv" || keyword == "bzp" || keyword == "bsp" ||
               keyword == "cdp") {  // the last three of old files
      file.fail("got a free-form surface in " + place + ", wanted polygons");
    }
  }
}

// ---- STL ----

namespace {

constexpr std::size_t kStlHeader = 84, kStlTriangle = 50;

void readBinaryStl(const FileBytes& file, std::uint32_t count, TriangleSoup& soup) {
  for (std::uint32_t n = 0; n < count; ++n) {
    float corners[9];
    std::memcpy(corners, file.begin() + kStlHeader + kStlTriangle * n + 12, sizeof(corners));
    const auto first = static_cast<std::int64_t>(soup.vertexCount());
    for (int c = 0; c < 3; ++c) {
      soup.addVertex(static_cast<double>(corners[3 * c]), static_cast<double>(corners[3 * c + 1]),
                     static_cast<double>(corners[3 * c + 2]));
    }
    soup.addPolygon({first, first + 1, first + 2});
  }
}

void readTextStl(const FileBytes& file, TriangleSoup& soup) {
  WordCursor cursor = file.text();
  bool open = false;
  std::vector<std::int64_t> corners;
  while (!cursor.atEnd()) {
    const std::string place = "line " + std::to_string(cursor.lineNumber());
    const std::string_view line = cursor.line();
    WordCursor words(line.data(), line.data() + line.size());
    const std::string keyword = lowerCase(words.next());  // some programs shout
    if (keyword == "solid") {
      open = true;
    } else if (keyword == "endsolid") {
      open = false;
    } else if (keyword == "vertex") {
      double p[3];
      for (double& x : p) {
        const std::string_view word = words.next();
        if (!parseNumber(word, &x))
          file.fail("got '" + shown(word) + "' in " + place + ", wanted vertex x y z");
      }
      corners.push_back(static_cast<std::int64_t>(soup.vertexCount()));
      soup.addVertex(p[0], p[1], p[2]);
    } else if (keyword == "endfacet") {
      if (corners.size() != 3) {
        file.fail("got a facet of " + std::to_string(corners.size()) + " vertices that ends in " + place +
                  ", wanted 3");
      }
      soup.addPolygon(corners);
      corners.clear();
    } else if (!keyword.empty() && keyword != "facet" && keyword != "outer" && keyword != "endloop") {
      file.fail("got '" + shown(keyword) + "' in " + place + ", wanted facet, vertex, ...");
    }
  }
  if (open || !corners.empty()) file.fail("is truncated: got no 'endsolid' in its end");
}

}  // namespace

void readStlTriangles(const FileBytes& file, TriangleSoup& soup) {
  std::uint32_t count = 0;
  if (file.size() >= kStlHeader) std::memcpy(&count, file.begin() + kStlHeader - 4, sizeof(count));
  const double promised = static_cast<double>(kStlHeader) + static_cast<double>(kStlTriangle) * count;
  WordCursor words = file.text();
  // Binary files may begin with "solid", too; a text holds no zeros.
  const bool text = std::find(file.begin(), file.end(), '\0') == file.end();
  if (file.size() >= kStlHeader && promised == static_cast<double>(file.size())) {
    readBinaryStl(file, count, soup);
  } else if (text && lowerCase(words.next()) == "solid") {
    readTextStl(file, soup);
  } else if (text) {
    file.fail("is neither a binary STL nor a text that begins with 'solid'");
  } else {
    file.fail("got " + std::to_string(file.size()) + " bytes, wanted " +
              std::to_string(static_cast<long long>(promised)) + " for the " + std::to_string(count) +
              " triangles that its header promises (truncated?)");
  }
}

}  // namespace ttsdf

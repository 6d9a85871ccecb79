// Points line by line: .xyz, .txt, .pts, .asc, .csv.

#include <algorithm>
#include <cctype>
#include <cmath>

#include "cloud_formats.h"

namespace ttsdf {

namespace {

using Words = std::vector<std::string_view>;

bool isBlank(char c) { return c == ' ' || c == '\t' || c == ';'; }

/// Between blanks, semicolons and commas; nothing between two commas is an empty word.
void split(std::string_view line, Words& words) {
  words.clear();
  std::size_t begin = 0;
  bool filled = false;  // a word since the last comma
  for (std::size_t n = 0; n <= line.size(); ++n) {
    const bool comma = n < line.size() && (line[n] == ',' || line[n] == ';');
    if (n < line.size() && !comma && !isBlank(line[n])) continue;
    if (n > begin) words.push_back(line.substr(begin, n - begin));
    filled = filled || n > begin;
    if (comma && !filled) words.emplace_back();
    if (comma) filled = false;
    begin = n + 1;
  }
}

/// "0,5 1,25 2,0": a comma within the first three words, where blanks or semicolons stand between them.
bool hasDecimalCommas(std::string_view line) {
  std::size_t words = 0;
  bool within = false;
  for (std::size_t n = 0; n < line.size() && words <= 3; ++n) {
    if (!isBlank(line[n]) && (n == 0 || isBlank(line[n - 1]))) ++words;
    const auto digit = [&line](std::size_t at) {
      return at < line.size() && std::isdigit(static_cast<unsigned char>(line[at])) != 0;
    };
    within = within || (words <= 3 && line[n] == ',' && n > 0 && digit(n - 1) && digit(n + 1));
  }
  return within && words >= 3;
}

/// A column's name without quotes, units and the marks that headings begin with.
std::string nameOf(std::string_view word) {
  std::string name;
  for (const char c : lowerCase(word)) {
    if (c == '[' || c == '(') break;
    if (c != '"' && c != '\'' && c != '#' && c != '/') name += c;
  }
  return name;
}

/// Where x y z, and the normal if there is one, stand in a line.
class Columns {
 public:
  explicit Columns(const FileBytes& file) : file_(file) {}

  /// A line that is no numbers: a heading, or a comment that may be one.
  void name(std::string_view line, bool comment) {
    Words words;
    split(line, words);
    names_.clear();
    for (const std::string_view word : words) {
      const std::string name = nameOf(word);
      if (!name.empty() || word.empty()) names_.push_back(name);  // else a mark alone
    }
    heading_ = std::string(line);
    comment_ = comment;
  }

  /// At the first line of numbers: a heading of as many words names its columns; others are titles.
  void settle(std::size_t count, const std::string& place) {
    const bool names_all = names_.size() == count;
    const bool found =
        look({"x", "points:0", "points_0"}, {"y", "points:1", "points_1"}, {"z", "points:2", "points_2"}, 0);
    if (found && !names_all) {
      file_.fail("got " + std::to_string(count) + " values in " + place + " under the heading '" +
                 shown(heading_) + "' of " + std::to_string(names_.size()) + " names, wanted one each");
    }
    if (names_all && !found && !comment_ && count > 3) {
      file_.fail("got the heading '" + shown(heading_) +
                 "', wanted columns x, y and z in it (or no heading)");
    }
    if (found) {
      normals_ =
          look({"nx", "normal_x", "normals:0", "normals_0"}, {"ny", "normal_y", "normals:1", "normals_1"},
               {"nz", "normal_z", "normals:2", "normals_2"}, 3);
    } else {
      normals_ = count >= 6 && lowerEnding(file_.path()) == ".xyzn";
    }
  }

  std::size_t operator[](std::size_t n) const { return places_[n]; }
  std::size_t count() const { return normals_ ? 6 : 3; }

 private:
  using Names = std::initializer_list<const char*>;

  bool look(Names x, Names y, Names z, std::size_t first) {
    std::size_t found[3], n = 0;
    for (const Names* wanted : {&x, &y, &z}) {
      const auto place = std::find_if(names_.begin(), names_.end(), [wanted](const std::string& name) {
        return std::find(wanted->begin(), wanted->end(), name) != wanted->end();
      });
      if (place == names_.end()) return false;
      found[n++] = static_cast<std::size_t>(place - names_.begin());
    }
    std::copy(found, found + 3, places_ + first);
    return true;
  }

  const FileBytes& file_;
  std::size_t places_[6] = {0, 1, 2, 3, 4, 5};
  bool normals_ = false, comment_ = false;
  std::vector<std::string> names_;
  std::string heading_;
};

bool isComment(std::string_view line) { return line[0] == '#' || line.substr(0, 2) == "//"; }

std::string_view withoutBlanks(std::string_view line) {
  while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
  while (!line.empty() && (line.back() == ' ' || line.back() == '\t')) line.remove_suffix(1);
  return line;
}

}  // namespace

CloudFile readTextCloud(const FileBytes& file) {
  WordCursor cursor = file.text();
  Columns columns(file);
  std::vector<double> numbers;
  Words words;
  std::int64_t promised = -1;
  bool first = true;  // of the lines that are no comments
  while (!cursor.atEnd()) {
    const std::string place = "line " + std::to_string(cursor.lineNumber());
    const std::string_view line = withoutBlanks(cursor.line());
    if (line.empty()) continue;
    if (isComment(line)) {
      if (first) columns.name(line, true);
      continue;
    }
    if (hasDecimalCommas(line))
      file.fail("got '" + shown(line) + "' in " + place + ", wanted decimal points (1.5) and not commas");
    split(line, words);
    double p[6];
    if (first) {
      first = false;
      if (words.size() == 1 && parseNumber(words[0], &promised)) continue;  // as .pts files begin
      if (words.empty() || !parseNumber(words[0], &p[0])) {
        columns.name(line, false);
        continue;
      }
    }
    if (numbers.empty()) columns.settle(words.size(), place);
    for (std::size_t n = 0; n < columns.count(); ++n) {
      if (columns[n] >= words.size() || !parseNumber(words[columns[n]], &p[n]))
        file.fail("got '" + shown(line) + "' in " + place + ", wanted x y z");
    }
    numbers.insert(numbers.end(), p, p + columns.count());
  }
  if (numbers.empty()) file.fail("got no line of numbers, wanted x y z");
  const auto rows = static_cast<Eigen::Index>(columns.count());
  const auto count = static_cast<Eigen::Index>(numbers.size()) / rows;
  if (promised >= 0 && promised != count) {
    file.fail("got " + std::to_string(count) + " points, wanted the " + std::to_string(promised) +
              " that its first line promises");
  }
  const Eigen::Map<const Eigen::MatrixXd> values(numbers.data(), rows, count);
  CloudFile cloud;
  cloud.points = values.topRows(3);
  if (rows == 6) cloud.normals = values.bottomRows(3).cast<float>();
  return cloud;
}

}  // namespace ttsdf

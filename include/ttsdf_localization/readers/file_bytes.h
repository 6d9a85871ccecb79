#pragma once
// A whole file in memory, and a cursor over its words. Every reader here works on these: nothing is read past
// the end, and what a header promises can be held against what is there before anything is allocated.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace ttsdf {

class WordCursor;

/// Bytes of a regular file. Throws std::runtime_error("WHAT 'PATH': ..."): no such file, a folder, a device
/// or pipe, empty.
class FileBytes {
 public:
  FileBytes(std::string what, std::string path);

  const char* begin() const { return bytes_.data(); }
  const char* end() const { return bytes_.data() + bytes_.size(); }
  std::size_t size() const { return bytes_.size(); }
  /// The file as a text, behind the mark that some editors begin UTF-8 with. Throws for UTF-16.
  WordCursor text() const;
  const std::string& path() const { return path_; }
  /// Throws std::runtime_error("WHAT 'PATH': MESSAGE").
  [[noreturn]] void fail(const std::string& message) const;

 private:
  /// What downloads leave in a file's place.
  void refuseStandIns() const;

  std::string what_, path_;
  std::vector<char> bytes_;
};

/// Splits text into words, over lines (ended by LF, CRLF or CR) or within one.
class WordCursor {
 public:
  WordCursor(const char* begin, const char* end) : position_(begin), end_(end) {}

  /// The next word of the text; empty at its end.
  std::string_view next();
  /// The next word of this line; empty at the line's end.
  std::string_view nextInLine();
  /// Moves behind the end of this line.
  void skipLine();
  /// The rest of this line without its end; moves behind it.
  std::string_view line();
  /// Moves over white space and, where `comment` is not 0, over comments from it to the end of their lines.
  void skipBlank(char comment = 0);
  bool atEnd() const { return position_ >= end_; }
  const char* position() const { return position_; }
  std::size_t remaining() const { return static_cast<std::size_t>(end_ - position_); }
  std::size_t lineNumber() const { return line_; }

 private:
  void skipSpaces(bool over_lines);
  void stepOverLineEnd();

  const char* position_;
  const char* end_;
  std::size_t line_ = 1;
};

/// The whole word as a number, whatever the locale; "nan" and "inf" are numbers. False for anything else.
bool parseNumber(std::string_view word, double* number);
/// A whole number.
bool parseNumber(std::string_view word, std::int64_t* number);
/// All numbers of a text, between blanks, commas, semicolons and brackets; at most one more than `most`.
/// Throws std::runtime_error naming the file for what is no finite number.
std::vector<double> finiteNumbers(const FileBytes& file, std::size_t most);
std::string lowerCase(std::string_view text);
/// The ending of a file's name in lower case: ".ply".
std::string lowerEnding(const std::string& path);
/// At the most 40 characters of a file's text, for a message: what cannot be printed is replaced.
std::string shown(std::string_view text);

}  // namespace ttsdf

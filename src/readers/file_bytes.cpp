#include "ttsdf_localization/readers/file_bytes.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

namespace ttsdf {

namespace fs = std::filesystem;

FileBytes::FileBytes(std::string what, std::string path) : what_(std::move(what)), path_(std::move(path)) {
  std::error_code error;
  const fs::file_status status = fs::status(path_, error);
  if (!fs::exists(status)) fail("no such file");
  if (fs::is_directory(status)) fail("is a folder, wanted a file");
  if (!fs::is_regular_file(status)) fail("is a device or a pipe, wanted a file");
  const std::uintmax_t size = fs::file_size(path_, error);
  std::ifstream in(path_, std::ios::binary);
  if (error || !in) fail("cannot be opened");
  if (size == 0) fail("is empty");
  bytes_.resize(size);
  in.read(bytes_.data(), static_cast<std::streamsize>(size));
  if (!in) fail("cannot be read");
  refuseStandIns();
}

void FileBytes::refuseStandIns() const {
  const std::string_view start(bytes_.data(), std::min<std::size_t>(bytes_.size(), 64));
  if (start.rfind("version https://git-lfs", 0) == 0) {
    fail("is a pointer of Git LFS and not the file itself ('git lfs pull' fetches it)");
  }
  if (start.rfind("<!DOCTYPE html", 0) == 0 || start.rfind("<html", 0) == 0) {
    fail("is a web page: the download got a page about the file instead of the file");
  }
  if (start.rfind("PK\3\4", 0) == 0 || start.rfind("\x1f\x8b", 0) == 0)
    fail("is compressed (zip or gzip), wanted it unpacked");
}

WordCursor FileBytes::text() const {
  const std::string_view start(bytes_.data(), std::min<std::size_t>(bytes_.size(), 3));
  if (start.substr(0, 2) == "\xff\xfe" || start.substr(0, 2) == "\xfe\xff")
    fail("is a text in UTF-16, wanted plain text (ASCII or UTF-8)");
  return {begin() + (start == "\xef\xbb\xbf" ? 3 : 0), end()};
}

void FileBytes::fail(const std::string& message) const {
  throw std::runtime_error(what_ + " '" + path_ + "': " + message);
}

namespace {
bool isSpace(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
bool isLineEnd(char c) { return c == '\n' || c == '\r'; }
}  // namespace

void WordCursor::stepOverLineEnd() {
  if (atEnd()) return;
  const bool pair = *position_ == '\r' && position_ + 1 < end_ && position_[1] == '\n';
  position_ += pair ? 2 : 1;
  ++line_;
}

void WordCursor::skipSpaces(bool over_lines) {
  while (!atEnd()) {
    if (isSpace(*position_)) {
      ++position_;
    } else if (over_lines && isLineEnd(*position_)) {
      stepOverLineEnd();
    } else {
      return;
    }
  }
}

std::string_view WordCursor::next() {
  skipSpaces(true);
  return nextInLine();
}

std::string_view WordCursor::nextInLine() {
  skipSpaces(false);
  const char* first = position_;
  while (!atEnd() && !isSpace(*position_) && !isLineEnd(*position_)) ++position_;
  return {first, static_cast<std::size_t>(position_ - first)};
}

std::string_view WordCursor::line() {
  const char* first = position_;
  while (!atEnd() && !isLineEnd(*position_)) ++position_;
  const std::string_view text(first, static_cast<std::size_t>(position_ - first));
  stepOverLineEnd();
  return text;
}

void WordCursor::skipLine() { line(); }

void WordCursor::skipBlank(char comment) {
  for (;;) {
    skipSpaces(true);
    if (atEnd() || comment == 0 || *position_ != comment) return;
    skipLine();
  }
}

bool parseNumber(std::string_view word, double* number) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  if (word.empty()) return false;
#if defined(__cpp_lib_to_chars)
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), *number);
  if (error == std::errc::result_out_of_range && end == word.data() + word.size()) {
    *number = std::strtod(std::string(word).c_str(), nullptr);  // 0 or infinity
    return true;
  }
  return error == std::errc() && end == word.data() + word.size();
#else
  const std::string text(word);
  char* end = nullptr;
  *number = std::strtod(text.c_str(), &end);
  return end == text.c_str() + text.size();
#endif
}

bool parseNumber(std::string_view word, std::int64_t* number) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), *number);
  return !word.empty() && error == std::errc() && end == word.data() + word.size();
}

std::vector<double> finiteNumbers(const FileBytes& file, std::size_t most) {
  const WordCursor text = file.text();
  std::string content(text.position(), text.remaining());
  std::replace_if(
      content.begin(), content.end(), [](char c) { return c == ',' || c == ';' || c == '[' || c == ']'; },
      ' ');
  WordCursor words(content.data(), content.data() + content.size());
  std::vector<double> numbers;
  for (std::string_view word = words.next(); !word.empty() && numbers.size() <= most; word = words.next()) {
    double value = 0.0;
    if (!parseNumber(word, &value) || !std::isfinite(value))
      file.fail("got '" + shown(word) + "', wanted a finite number");
    numbers.push_back(value);
  }
  return numbers;
}

std::string lowerCase(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

std::string lowerEnding(const std::string& path) { return lowerCase(fs::path(path).extension().string()); }

std::string shown(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string result(text.substr(0, kLongest));
  for (char& c : result) {
    if (c < ' ' || c > '~') c = '?';
  }
  return result + (text.size() > kLongest ? "..." : "");
}

}  // namespace ttsdf

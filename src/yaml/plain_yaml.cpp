#include "ttsdf_localization/yaml/plain_yaml.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace ttsdf {

namespace {

constexpr std::size_t kDeepest = 16;
constexpr int kMostEvents = 1 << 22;

/// Goes through a document without building anything of it; yaml-cpp descends by recursion, and this ends it
/// early.
class Guard : public YAML::EventHandler {
 public:
  Guard(std::string file, Aliases aliases) : file_(std::move(file)), aliases_(aliases) {}
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {
    count();
    value();
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    count();
    value();
    const bool holds_itself = std::any_of(open_.begin(), open_.end(),
                                          [anchor](const Level& level) { return level.anchor == anchor; });
    if (aliases_ == Aliases::kAllowed && !holds_itself) return;
    throw std::runtime_error(file_ + "got an alias in line " + std::to_string(mark.line + 1) +
                             (aliases_ == Aliases::kAllowed ? " of what holds it" : ", wanted plain values"));
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                const std::string& text) override {
    count();
    if (value()) return;
    if (!open_.back().keys.insert(text).second) {
      throw std::runtime_error(file_ + "got the key '" + text.substr(0, 40) + "' again in line " +
                               std::to_string(mark.line + 1) + ", wanted it once");
    }
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    deeper(mark, anchor, false);
  }
  void OnSequenceEnd() override { open_.pop_back(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    deeper(mark, anchor, true);
  }
  void OnMapEnd() override { open_.pop_back(); }

 private:
  /// A list or a map that is open.
  struct Level {
    YAML::anchor_t anchor = 0;  ///< 0 without one
    bool map = false, key_next = true;
    std::set<std::string> keys;
  };

  /// Keys and values of a map take turns. False for a key.
  bool value() {
    if (open_.empty() || !open_.back().map) return true;
    open_.back().key_next = !open_.back().key_next;
    return open_.back().key_next;
  }
  /// yaml-cpp 0.6 goes on for ever over some broken texts.
  void count() {
    if (++events_ > kMostEvents) throw std::runtime_error(file_ + "is no YAML: its parts do not end");
  }
  void deeper(const YAML::Mark& mark, YAML::anchor_t anchor, bool map) {
    count();
    value();
    open_.emplace_back();
    open_.back().anchor = anchor;
    open_.back().map = map;
    if (open_.size() > kDeepest) {
      throw std::runtime_error(file_ + "is nested deeper than " + std::to_string(kDeepest) +
                               " levels in line " + std::to_string(mark.line + 1));
    }
  }

  std::string file_;
  const Aliases aliases_;
  std::vector<Level> open_;
  int events_ = 0;
};

/// Throws if a list or a map in brackets has no end: yaml-cpp before 0.7 then looks for it for ever. Of
/// quotes without an end it takes all that follows for their text.
void requireClosedBrackets(const std::string& text, const std::string& file) {
  std::vector<int> open;  // lines of brackets
  char quote = 0;
  int line = 1, quote_line = 1;
  for (std::size_t n = 0; n < text.size(); ++n) {
    const char c = text[n];
    if (c == '\n') ++line;
    if (quote != 0) {
      if (quote == '"' && c == '\\') ++n;
      if (c == quote) quote = 0;
    } else if (c == '\'' || c == '"') {
      const std::size_t before = text.find_last_not_of(" \t", n - 1);  // else within words: rock 'n roll
      if (n == 0 || before == std::string::npos || std::strchr("\n,:[{-?", text[before]) != nullptr)
        quote = c, quote_line = line;
    } else if (c == '#' && (n == 0 || std::isspace(static_cast<unsigned char>(text[n - 1])))) {
      while (n + 1 < text.size() && text[n + 1] != '\n') ++n;
    } else if (c == '[' || c == '{') {
      open.push_back(line);
    } else if ((c == ']' || c == '}') && !open.empty()) {
      open.pop_back();
    }
  }
  if (quote != 0)
    throw std::runtime_error(file + "got a quote in line " + std::to_string(quote_line) +
                             " that is not closed");
  if (!open.empty())
    throw std::runtime_error(file + "got a bracket in line " + std::to_string(open.back()) +
                             " that is not closed");
}

}  // namespace

YAML::Node plainYaml(const std::string& what, const std::string& text, Aliases aliases) {
  const auto zero = text.find('\0');
  if (zero != std::string::npos && text.compare(0, 2, "\xff\xfe") != 0 && text.compare(0, 2, "\xfe\xff") != 0)
    throw std::runtime_error(what + "got a byte 0, wanted a text");
  requireClosedBrackets(text, what);
  try {
    std::stringstream stream(text);
    YAML::Parser parser(stream);
    Guard guard(what, aliases);
    if (!parser.HandleNextDocument(guard)) return {};
    if (parser.HandleNextDocument(guard))
      throw std::runtime_error(what + "got a second document behind '---', wanted one");
    return YAML::Load(text);
  } catch (const YAML::Exception& problem) {
    throw std::runtime_error(what + problem.what());
  }
}

YAML::Node loadPlainYaml(const std::string& what, const std::string& path, std::size_t max_bytes,
                         Aliases aliases) {
  const std::string name = what + " '" + path + "': ";
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) throw std::runtime_error(name + "no such file");
  const auto size = std::filesystem::file_size(path, error);
  if (error) throw std::runtime_error(name + error.message());
  if (size > max_bytes) {
    throw std::runtime_error(name + "got " + std::to_string(size) + " bytes, wanted at most " +
                             std::to_string(max_bytes));
  }
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  if (!in) throw std::runtime_error(name + "cannot be read");
  return plainYaml(name, text.str(), aliases);
}

}  // namespace ttsdf

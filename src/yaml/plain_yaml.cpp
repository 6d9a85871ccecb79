#include "ttsdf_localization/yaml/plain_yaml.h"

#include <yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

namespace ttsdf {

namespace {

constexpr std::size_t kDeepest = 16;

std::string words(const yaml_char_t* text) { return text ? reinterpret_cast<const char*>(text) : ""; }

/// libyaml's events made into yaml-cpp's nodes: yaml-cpp's own parser goes on for ever over some texts
/// (before 0.7), or ends by a stack overflow.
class Builder {
 public:
  Builder(const std::string& what, const std::string& text, Aliases aliases)
      : what_(what), text_(text), aliases_(aliases) {
    if (!yaml_parser_initialize(&parser_)) throw std::bad_alloc();
    yaml_parser_set_input_string(&parser_, reinterpret_cast<const unsigned char*>(text.data()), text.size());
  }
  ~Builder() { yaml_parser_delete(&parser_); }
  Builder(const Builder&) = delete;
  Builder& operator=(const Builder&) = delete;

  YAML::Node document() {
    for (bool more = true; more;) {
      yaml_event_t event;
      if (!yaml_parser_parse(&parser_, &event)) refuse(problemMark(), problem());
      try {
        more = take(event);
      } catch (...) {
        yaml_event_delete(&event);
        throw;
      }
      yaml_event_delete(&event);
    }
    return root_;
  }

 private:
  struct Open {
    YAML::Node node;
    std::string anchor;
    bool has_key = false;  ///< of a map: a key waits for its value
    YAML::Node key;
    std::set<std::string> keys;
  };

  [[noreturn]] void refuse(const yaml_mark_t& mark, const std::string& problem) const {
    throw std::runtime_error(what_ + "line " + std::to_string(mark.line + 1) + ", column " +
                             std::to_string(mark.column + 1) + ": " + problem);
  }

  /// Bytes that are no UTF-8 come without a mark.
  yaml_mark_t problemMark() const {
    if (parser_.error != YAML_READER_ERROR) return parser_.problem_mark;
    const auto begin = text_.begin(), end = begin + std::min(parser_.problem_offset, text_.size());
    yaml_mark_t mark{};
    mark.line = static_cast<std::size_t>(std::count(begin, end, '\n'));
    const auto line = std::find(std::make_reverse_iterator(end), std::make_reverse_iterator(begin), '\n');
    mark.column = static_cast<std::size_t>(end - line.base());
    return mark;
  }

  std::string problem() const {
    std::string text = parser_.problem ? parser_.problem : "is no YAML";
    if (parser_.context) {
      text += std::string(" ") + parser_.context;
      text += " that begins in line " + std::to_string(parser_.context_mark.line + 1);
    }
    return text;
  }

  /// False at the end.
  bool take(const yaml_event_t& event) {
    switch (event.type) {
      case YAML_DOCUMENT_START_EVENT:
        if (++documents_ > 1) refuse(event.start_mark, "got a second document, wanted one");
        return true;
      case YAML_SCALAR_EVENT:
        add(scalar(event), words(event.data.scalar.anchor), event.start_mark);
        return true;
      case YAML_SEQUENCE_START_EVENT:
        open(YAML::NodeType::Sequence, words(event.data.sequence_start.anchor), event);
        setFlow(event.data.sequence_start.style == YAML_FLOW_SEQUENCE_STYLE);
        return true;
      case YAML_MAPPING_START_EVENT:
        open(YAML::NodeType::Map, words(event.data.mapping_start.anchor), event);
        setFlow(event.data.mapping_start.style == YAML_FLOW_MAPPING_STYLE);
        return true;
      case YAML_SEQUENCE_END_EVENT:
      case YAML_MAPPING_END_EVENT: {
        Open closed = std::move(open_.back());
        open_.pop_back();
        add(closed.node, closed.anchor, event.start_mark);
        return true;
      }
      case YAML_ALIAS_EVENT:
        add(alias(event), "", event.start_mark);
        return true;
      case YAML_STREAM_END_EVENT:
        return false;
      case YAML_NO_EVENT:
      case YAML_STREAM_START_EVENT:
      case YAML_DOCUMENT_END_EVENT:
        break;
    }
    return true;
  }

  static YAML::Node scalar(const yaml_event_t& event) {
    const auto& data = event.data.scalar;
    const std::string value(reinterpret_cast<const char*>(data.value), data.length);
    const bool plain = data.style == YAML_PLAIN_SCALAR_STYLE;
    if (plain && !data.tag && YAML::IsNullString(value)) return YAML::Node(YAML::NodeType::Null);
    YAML::Node node(value);
    node.SetTag(data.tag ? words(data.tag) : plain ? "?" : "!");  // as yaml-cpp does
    return node;
  }

  YAML::Node alias(const yaml_event_t& event) const {
    const std::string anchor = words(event.data.alias.anchor);
    if (aliases_ == Aliases::kRefused) refuse(event.start_mark, "got an alias, wanted plain values");
    const auto holds_it = [&anchor](const Open& open) { return open.anchor == anchor; };
    if (std::any_of(open_.begin(), open_.end(), holds_it))
      refuse(event.start_mark, "got an alias of what holds it");
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end()) refuse(event.start_mark, "got an alias of nothing: '" + anchor + "'");
    return found->second;
  }

  void open(YAML::NodeType::value type, const std::string& anchor, const yaml_event_t& event) {
    if (open_.size() >= kDeepest)
      refuse(event.start_mark, "nested deeper than " + std::to_string(kDeepest) + " levels");
    Open open;
    open.node = YAML::Node(type);
    open.anchor = anchor;
    open_.push_back(std::move(open));
  }

  /// As it was written, for those who print it.
  void setFlow(bool flow) {
    open_.back().node.SetStyle(flow ? YAML::EmitterStyle::Flow : YAML::EmitterStyle::Block);
  }

  void add(const YAML::Node& node, const std::string& anchor, const yaml_mark_t& mark) {
    if (!anchor.empty()) {
      anchors_.erase(anchor);  // assigning a node would change the one that was named so before
      anchors_.emplace(anchor, node);
    }
    if (open_.empty()) {
      root_.reset(node);
      return;
    }
    Open& into = open_.back();
    if (into.node.IsSequence()) {
      into.node.push_back(node);
    } else if (into.has_key) {
      into.node.force_insert(into.key, node);
      into.has_key = false;
    } else {
      if (node.IsScalar() && !into.keys.insert(node.Scalar()).second)
        refuse(mark, "got the key '" + node.Scalar().substr(0, 40) + "' again, wanted it once");
      into.key.reset(node);
      into.has_key = true;
    }
  }

  const std::string &what_, &text_;
  const Aliases aliases_;
  yaml_parser_t parser_;
  std::vector<Open> open_;  ///< lists and maps that are not closed
  std::map<std::string, YAML::Node> anchors_;
  YAML::Node root_;
  int documents_ = 0;
};

}  // namespace

YAML::Node plainYaml(const std::string& what, const std::string& text, Aliases aliases) {
  // libyaml takes it for the end.
  const auto zero = text.find('\0');
  const bool utf16 = text.compare(0, 2, "\xff\xfe") == 0 || text.compare(0, 2, "\xfe\xff") == 0;
  if (zero != std::string::npos && !utf16) throw std::runtime_error(what + "got a byte 0, wanted a text");
  return Builder(what, text, aliases).document();
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

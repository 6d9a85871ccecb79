#include "ply_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace ttsdf {

namespace {

constexpr std::size_t kMaxElements = 100, kMaxProperties = 1000;

std::size_t bytesOf(PlyType type) {
  switch (type) {
    case PlyType::kInt8:
    case PlyType::kUint8:
      return 1;
    case PlyType::kInt16:
    case PlyType::kUint16:
      return 2;
    case PlyType::kInt32:
    case PlyType::kUint32:
    case PlyType::kFloat32:
      return 4;
    case PlyType::kFloat64:
      break;
  }
  return 8;
}

bool typeFromName(std::string_view name, PlyType* type) {
  static const std::vector<std::pair<std::string_view, PlyType>> kNames = {
      {"char", PlyType::kInt8},      {"int8", PlyType::kInt8},       {"uchar", PlyType::kUint8},
      {"uint8", PlyType::kUint8},    {"short", PlyType::kInt16},     {"int16", PlyType::kInt16},
      {"ushort", PlyType::kUint16},  {"uint16", PlyType::kUint16},   {"int", PlyType::kInt32},
      {"int32", PlyType::kInt32},    {"uint", PlyType::kUint32},     {"uint32", PlyType::kUint32},
      {"float", PlyType::kFloat32},  {"float32", PlyType::kFloat32}, {"double", PlyType::kFloat64},
      {"float64", PlyType::kFloat64}};
  const auto found =
      std::find_if(kNames.begin(), kNames.end(), [&](const auto& n) { return n.first == name; });
  if (found == kNames.end()) return false;
  *type = found->second;
  return true;
}

template <class T>
double valueAs(const char* bytes, bool swap) {
  char copy[sizeof(T)];
  std::memcpy(copy, bytes, sizeof(T));
  if (swap) std::reverse(copy, copy + sizeof(T));
  T value;
  std::memcpy(&value, copy, sizeof(T));
  return static_cast<double>(value);
}

double valueOf(PlyType type, const char* bytes, bool swap) {
  switch (type) {
    case PlyType::kInt8:
      return valueAs<std::int8_t>(bytes, swap);
    case PlyType::kUint8:
      return valueAs<std::uint8_t>(bytes, swap);
    case PlyType::kInt16:
      return valueAs<std::int16_t>(bytes, swap);
    case PlyType::kUint16:
      return valueAs<std::uint16_t>(bytes, swap);
    case PlyType::kInt32:
      return valueAs<std::int32_t>(bytes, swap);
    case PlyType::kUint32:
      return valueAs<std::uint32_t>(bytes, swap);
    case PlyType::kFloat32:
      return valueAs<float>(bytes, swap);
    case PlyType::kFloat64:
      break;
  }
  return valueAs<double>(bytes, swap);
}

/// Where the next value comes from: words of a text or bytes.
class ValueSource {
 public:
  virtual ~ValueSource() = default;
  virtual double next(PlyType type) = 0;
  virtual void endItem() {}
  /// Values that the rest of the file may still hold at the most.
  virtual std::uint64_t mostValues(PlyType type) const = 0;
  virtual bool hasMore() = 0;

  /// "vertex 17 of 600", for messages.
  std::string itemText() const {
    return element->name + " " + std::to_string(item) + " of " + std::to_string(element->count);
  }

  const PlyElement* element = nullptr;
  std::uint64_t item = 0;
};

class BinarySource : public ValueSource {
 public:
  BinarySource(const FileBytes& file, const char* begin, bool swap)
      : file_(file), position_(begin), swap_(swap) {}

  double next(PlyType type) override {
    const std::size_t size = bytesOf(type);
    if (static_cast<std::size_t>(file_.end() - position_) < size) {
      file_.fail("is truncated: got its end in " + itemText());
    }
    const double value = valueOf(type, position_, swap_);
    position_ += size;
    return value;
  }
  std::uint64_t mostValues(PlyType type) const override {
    return static_cast<std::uint64_t>(file_.end() - position_) / bytesOf(type);
  }
  bool hasMore() override {
    // Some writers end with a line end or fill up with zeros.
    constexpr std::ptrdiff_t kFill = 16;
    const auto blank = [](char c) { return c == 0 || c == '\n' || c == '\r' || c == ' '; };
    return file_.end() - position_ > kFill || !std::all_of(position_, file_.end(), blank);
  }

 private:
  const FileBytes& file_;
  const char* position_;
  bool swap_;
};

class AsciiSource : public ValueSource {
 public:
  AsciiSource(const FileBytes& file, const char* begin) : file_(file), words_(begin, file.end()) {}

  double next(PlyType) override {
    const std::string_view word = words_.next();
    if (word.empty()) file_.fail("is truncated: got its end in " + itemText());
    double value = 0.0;
    if (!parseNumber(word, &value))
      file_.fail("got '" + shown(word) + "' in " + itemText() + ", wanted a number");
    return value;
  }
  void endItem() override {
    const std::string_view rest = words_.nextInLine();
    if (!rest.empty()) {
      file_.fail("got '" + shown(rest) + "' behind the values of " + itemText() +
                 ", wanted the line to end there");
    }
  }
  std::uint64_t mostValues(PlyType) const override { return words_.remaining() / 2 + 1; }
  bool hasMore() override {
    words_.skipBlank();
    return !words_.atEnd();
  }

 private:
  const FileBytes& file_;
  WordCursor words_;
};

void readItem(const FileBytes& file, const PlyElement& element, ValueSource& source, PlyItem& item) {
  for (std::size_t p = 0; p < element.properties.size(); ++p) {
    const PlyProperty& property = element.properties[p];
    if (!property.list) {
      item.scalars[p] = source.next(property.type);
      continue;
    }
    const double length = source.next(property.count_type);
    // The comparison also refuses NaN.
    if (length != std::floor(length))
      file.fail("got a list of " + std::to_string(length) + " values in " + source.itemText() +
                ", wanted a whole number");
    if (!(length >= 0.0 && length <= static_cast<double>(source.mostValues(property.type)))) {
      file.fail("is truncated or damaged: got a list of " + std::to_string(static_cast<long long>(length)) +
                " values in " + source.itemText() + ", more than the rest of the file holds");
    }
    item.scalars[p] = length;
    std::vector<double>& values = item.lists[p];
    values.resize(static_cast<std::size_t>(length));
    for (double& value : values) value = source.next(property.type);
  }
  source.endItem();
}

}  // namespace

bool isWhole(PlyType type) { return type != PlyType::kFloat32 && type != PlyType::kFloat64; }

int PlyElement::find(const std::string& property) const {
  for (std::size_t p = 0; p < properties.size(); ++p) {
    if (properties[p].name == property) return static_cast<int>(p);
  }
  return -1;
}

PlyFile::PlyFile(const FileBytes& file) : file_(file) {
  parseHeader();
  checkCounts();
}

const PlyElement* PlyFile::find(const std::string& element) const {
  for (const PlyElement& e : elements_) {
    if (e.name == element) return &e;
  }
  return nullptr;
}

void PlyFile::parseHeader() {
  WordCursor cursor = file_.text();
  if (cursor.line() != "ply") fail("got no PLY header, wanted 'ply' in the first line");
  bool has_format = false;
  for (;;) {
    if (cursor.atEnd()) fail("got a header without 'end_header'");
    const std::string_view line = cursor.line();
    WordCursor words(line.data(), line.data() + line.size());
    const std::string_view keyword = words.nextInLine();
    if (keyword == "end_header") break;
    if (keyword.empty() || keyword == "comment" || keyword == "obj_info") continue;
    if (keyword == "format") {
      const std::string_view name = words.nextInLine();
      if (name != "ascii" && name != "binary_little_endian" && name != "binary_big_endian") {
        fail("got format '" + shown(name) + "', wanted ascii, binary_little_endian or binary_big_endian");
      }
      format_ = name == "ascii"               ? Format::kAscii
                : name == "binary_big_endian" ? Format::kBig
                                              : Format::kLittle;
      has_format = true;
    } else if (keyword == "element") {
      PlyElement element;
      element.name = std::string(words.nextInLine());
      std::int64_t count = -1;
      if (!parseNumber(words.nextInLine(), &count) || count < 0 || elements_.size() >= kMaxElements) {
        fail("got the header line '" + shown(line) + "', wanted: element NAME COUNT");
      }
      element.count = static_cast<std::uint64_t>(count);
      elements_.push_back(std::move(element));
    } else if (keyword == "property") {
      parseProperty(words, line);
    } else {
      fail("got the header line '" + shown(line) +
           "', wanted format, comment, element, property or end_header");
    }
  }
  if (!has_format) fail("got a header without its format line");
  data_ = cursor.position();
}

void PlyFile::parseProperty(WordCursor& words, std::string_view line) {
  PlyProperty property;
  std::string_view type = words.nextInLine();
  bool good = !elements_.empty() && elements_.back().properties.size() < kMaxProperties;
  if (type == "list") {
    property.list = true;
    good = good && typeFromName(words.nextInLine(), &property.count_type);
    type = words.nextInLine();
  }
  good = good && typeFromName(type, &property.type);
  property.name = std::string(words.nextInLine());
  if (!good || property.name.empty() || elements_.back().find(property.name) >= 0) {
    fail("got the header line '" + shown(line) +
         "', wanted: property [list COUNT-TYPE] TYPE NAME, in an element, once");
  }
  elements_.back().properties.push_back(std::move(property));
}

void PlyFile::checkCounts() const {
  double wanted = 0.0;
  for (const PlyElement& element : elements_) {
    double item = 0.0;
    for (const PlyProperty& p : element.properties) {
      item += format_ == Format::kAscii ? 2.0 : static_cast<double>(bytesOf(p.list ? p.count_type : p.type));
    }
    wanted += item * static_cast<double>(element.count);
  }
  const auto got = static_cast<double>(file_.end() - data_);
  const double last_line_end = format_ == Format::kAscii ? 1.0 : 0.0;
  if (wanted > got + last_line_end) {
    fail("is truncated: its header promises at least " + std::to_string(static_cast<long long>(wanted)) +
         " bytes of data, got " + std::to_string(static_cast<long long>(got)));
  }
}

void PlyFile::read(const std::function<void(const PlyElement&, const PlyItem&)>& visit) const {
  AsciiSource ascii(file_, data_);
  BinarySource binary(file_, data_, format_ == Format::kBig);
  ValueSource& source = format_ == Format::kAscii ? static_cast<ValueSource&>(ascii) : binary;
  PlyItem item;
  for (const PlyElement& element : elements_) {
    if (element.properties.empty()) continue;
    source.element = &element;
    item.scalars.assign(element.properties.size(), 0.0);
    item.lists.assign(element.properties.size(), {});
    for (std::uint64_t n = 0; n < element.count; ++n) {
      source.item = n;
      readItem(file_, element, source, item);
      visit(element, item);
    }
  }
  if (source.hasMore()) fail("got more data than its header promises");
}

}  // namespace ttsdf

#include "gltf_data.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>

namespace ttsdf {

namespace {

constexpr std::size_t kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123,
                      kUnsignedInt = 5125, kFloat = 5126;

std::size_t sizeOf(std::size_t component) {
  switch (component) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

template <class T>
double as(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(value));
  return static_cast<double>(value);
}

double valueOf(std::size_t component, const char* bytes) {
  switch (component) {
    case kByte:
      return as<std::int8_t>(bytes);
    case kUnsignedByte:
      return as<std::uint8_t>(bytes);
    case kShort:
      return as<std::int16_t>(bytes);
    case kUnsignedShort:
      return as<std::uint16_t>(bytes);
    case kUnsignedInt:
      return as<std::uint32_t>(bytes);
    default:
      return as<float>(bytes);
  }
}

/// Whole numbers that stand for -1 to 1 or 0 to 1.
double largestOf(std::size_t component) {
  return component == kByte           ? 127.0
         : component == kUnsignedByte ? 255.0
         : component == kShort        ? 32767.0
                                      : 65535.0;
}

/// False for what is no base64.
bool decodeBase64(std::string_view text, std::string& bytes) {
  static const std::string kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  int value[256];
  std::fill(std::begin(value), std::end(value), -1);
  for (std::size_t n = 0; n < kDigits.size(); ++n)
    value[static_cast<unsigned char>(kDigits[n])] = static_cast<int>(n);
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  std::uint32_t bits = 0, held = 0;
  for (const char c : text) {
    const int digit = value[static_cast<unsigned char>(c)];
    if (digit < 0) return false;
    bits = (bits << 6 | static_cast<std::uint32_t>(digit)) & 0xffffffu;
    held += 6;
    if (held < 8) continue;
    held -= 8;
    bytes += static_cast<char>(bits >> held & 0xffu);
  }
  return true;
}

/// "a%20b.bin" as a file's name.
std::string unescaped(const std::string& uri) {
  std::string name;
  for (std::size_t n = 0; n < uri.size(); ++n) {
    const bool escape = uri[n] == '%' && n + 2 < uri.size() &&
                        std::isxdigit(static_cast<unsigned char>(uri[n + 1])) &&
                        std::isxdigit(static_cast<unsigned char>(uri[n + 2]));
    name += escape ? static_cast<char>(std::stoi(uri.substr(n + 1, 2), nullptr, 16)) : uri[n];
    if (escape) n += 2;
  }
  return name;
}

}  // namespace

GltfData::GltfData(const FileBytes& file) : file_(file), bytes_read_(file.size()) {
  if (file.size() >= 4 && std::memcmp(file.begin(), "glTF", 4) == 0) {
    splitBinary();
  } else {
    const WordCursor text = file.text();
    text_.assign(text.position(), text.remaining());
  }
  Json::CharReaderBuilder builder;
  builder["collectComments"] = false;
  std::string errors;
  const std::unique_ptr<Json::CharReader> reader(builder.newCharReader());
  if (!reader->parse(text_.data(), text_.data() + text_.size(), &json_, &errors) || !json_.isObject())
    file_.fail("is no glTF, or truncated: its json cannot be read");
  const Json::Value& asset = json_["asset"];
  const std::string version =
      asset.isObject() && asset["version"].isString() ? asset["version"].asString() : "none";
  if (version.rfind("2.", 0) != 0) file_.fail("got glTF version '" + shown(version) + "', wanted 2.0");
}

void GltfData::splitBinary() {
  const auto word = [this](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, file_.begin() + at, sizeof(value));
    return static_cast<std::size_t>(value);
  };
  constexpr std::size_t kHeader = 12, kChunkHeader = 8, kJson = 0x4e4f534a, kBinary = 0x004e4942;
  if (file_.size() < kHeader + kChunkHeader) file_.fail("is truncated: got no glTF header");
  if (word(4) != 2) file_.fail("got binary glTF version " + std::to_string(word(4)) + ", wanted 2");
  if (word(8) != file_.size()) {
    file_.fail("got " + std::to_string(file_.size()) + " bytes, wanted the " + std::to_string(word(8)) +
               " that its header promises (truncated?)");
  }
  for (std::size_t at = kHeader; at + kChunkHeader <= file_.size();) {
    const std::size_t size = word(at), kind = word(at + 4);
    at += kChunkHeader;
    if (size > file_.size() - at)
      file_.fail("is truncated: got its end in a chunk of " + std::to_string(size) + " bytes");
    if (kind == kJson) text_.assign(file_.begin() + at, size);
    if (kind == kBinary) binary_.assign(file_.begin() + at, size), has_binary_ = true;
    at += size;
  }
}

const Json::Value& GltfData::item(const char* list, std::size_t number) const {
  const Json::Value& values = json_[list];
  if (!values.isArray() || number >= values.size() ||
      !values[static_cast<Json::ArrayIndex>(number)].isObject()) {
    file_.fail("got number " + std::to_string(number) + " of " + list + ", wanted one of " +
               std::to_string(values.isArray() ? values.size() : 0));
  }
  return values[static_cast<Json::ArrayIndex>(number)];
}

std::size_t GltfData::asNumber(const Json::Value& value, const char* what) const {
  if (!value.isUInt64()) file_.fail(std::string("got no whole number from 0 on as ") + what);
  return static_cast<std::size_t>(value.asUInt64());
}

std::size_t GltfData::number(const Json::Value& object, const char* key, std::size_t otherwise) const {
  return object.isMember(key) ? asNumber(object[key], key) : otherwise;
}

std::vector<double> GltfData::numbers(const Json::Value& object, const char* key, std::size_t count,
                                      std::vector<double> otherwise) const {
  if (!object.isMember(key)) return otherwise;
  std::vector<double> values;
  for (const Json::Value& value : object[key]) {
    if (value.isNumeric() && std::isfinite(value.asDouble())) values.push_back(value.asDouble());
  }
  if (values.size() != count || object[key].size() != count)
    file_.fail(std::string("got '") + key + "' without " + std::to_string(count) + " finite numbers");
  return values;
}

std::string GltfData::fileOf(const std::string& uri) const {
  const std::filesystem::path name = unescaped(uri);
  if (name.is_absolute() || uri.find("://") != std::string::npos)
    file_.fail("got a buffer at '" + shown(uri) + "', wanted a file beside this one");
  return (std::filesystem::path(file_.path()).parent_path() / name).string();
}

const std::string& GltfData::buffer(std::size_t number) {
  const auto known = buffers_.find(number);
  if (known != buffers_.end()) return known->second;
  const Json::Value& entry = item("buffers", number);
  std::string bytes;
  if (!entry.isMember("uri")) {
    if (number != 0 || !has_binary_) file_.fail("got buffer " + std::to_string(number) + " without its data");
    bytes = binary_;
  } else if (const std::string uri = entry["uri"].asString(); uri.rfind("data:", 0) == 0) {
    const std::size_t comma = uri.find(";base64,");
    if (comma == std::string::npos || !decodeBase64(std::string_view(uri).substr(comma + 8), bytes))
      file_.fail("got buffer " + std::to_string(number) + " in its text that is no base64");
  } else {
    const FileBytes beside("buffer of '" + file_.path() + "'", fileOf(uri));
    bytes.assign(beside.begin(), beside.size());
    bytes_read_ += bytes.size();
  }
  const std::size_t promised = this->number(entry, "byteLength", 0);
  if (promised > bytes.size()) {
    file_.fail("got " + std::to_string(bytes.size()) + " bytes in buffer " + std::to_string(number) +
               ", wanted " + std::to_string(promised) + " (truncated?)");
  }
  bytes.resize(promised);
  return buffers_.emplace(number, std::move(bytes)).first->second;
}

GltfData::View GltfData::view(std::size_t number) {
  const Json::Value& entry = item("bufferViews", number);
  const std::string& bytes = buffer(this->number(entry, "buffer", 0));
  const std::size_t offset = this->number(entry, "byteOffset", 0),
                    size = this->number(entry, "byteLength", 0);
  if (offset > bytes.size() || size > bytes.size() - offset)
    file_.fail("got buffer view " + std::to_string(number) + " outside of its buffer");
  return {bytes.data() + offset, size, this->number(entry, "byteStride", 0)};
}

void GltfData::copy(const View& view, std::size_t offset, std::size_t component, std::size_t count,
                    std::size_t width, const std::vector<std::size_t>* places,
                    std::vector<double>& values) const {
  const std::size_t size = sizeOf(component) * width, step = view.stride != 0 ? view.stride : size;
  if (count == 0) return;
  if (offset > view.size || size > view.size - offset || (count - 1) > (view.size - offset - size) / step)
    file_.fail("got " + std::to_string(count) + " values outside of their buffer view (truncated?)");
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t to = places ? (*places)[n] : n;
    for (std::size_t c = 0; c < width; ++c)
      values[to * width + c] = valueOf(component, view.begin + offset + n * step + c * sizeOf(component));
  }
}

constexpr std::size_t kMostWithoutData = 10000000;  // zeros but for a few values

GltfAccessor GltfData::read(std::size_t number, const char* type, std::size_t width, bool positions) {
  const Json::Value& entry = item("accessors", number);
  const std::size_t component = this->number(entry, "componentType", 0);
  const bool known =
      positions ? sizeOf(component) > 0 && component != kUnsignedInt
                : component == kUnsignedByte || component == kUnsignedShort || component == kUnsignedInt;
  if (!known || entry["type"] != Json::Value(type)) {
    file_.fail("got accessor " + std::to_string(number) + " of component type " + std::to_string(component) +
               (positions ? ", wanted positions as VEC3 of floats (5126)"
                          : ", wanted indices as SCALAR of 5121, 5123 or 5125"));
  }
  GltfAccessor result;
  result.count = this->number(entry, "count", 0);
  const bool sparse = entry.isMember("sparse"), dense = entry.isMember("bufferView");
  const std::size_t limit = dense ? view(this->number(entry, "bufferView", 0)).size
                                  : std::min<std::size_t>(16 * bytes_read_, kMostWithoutData);
  if (result.count > limit || (!dense && !sparse))
    file_.fail("got accessor " + std::to_string(number) + " with " + std::to_string(result.count) +
               " values and without their data");
  result.values.assign(result.count * width, 0.0);
  if (dense) {
    copy(view(this->number(entry, "bufferView", 0)), this->number(entry, "byteOffset", 0), component,
         result.count, width, nullptr, result.values);
  }
  if (sparse) {
    const Json::Value& changes = entry["sparse"];
    const std::size_t count = this->number(changes, "count", 0);
    const Json::Value &at = changes["indices"], &to = changes["values"];
    const std::size_t at_component = this->number(at, "componentType", 0);
    if (count > result.count || sizeOf(at_component) == 0)
      file_.fail("got accessor " + std::to_string(number) + " with sparse values that cannot be");
    std::vector<double> places(count);
    copy(view(this->number(at, "bufferView", 0)), this->number(at, "byteOffset", 0), at_component, count, 1,
         nullptr, places);
    std::vector<std::size_t> whole;
    for (const double place : places) {
      if (!(place >= 0.0 && place < static_cast<double>(result.count)))
        file_.fail("got accessor " + std::to_string(number) + " with a sparse value out of range");
      whole.push_back(static_cast<std::size_t>(place));
    }
    copy(view(this->number(to, "bufferView", 0)), this->number(to, "byteOffset", 0), component, count, width,
         &whole, result.values);
  }
  if (positions && component != kFloat && entry["normalized"].isBool() && entry["normalized"].asBool()) {
    for (double& value : result.values) value = std::max(value / largestOf(component), -1.0);
  }
  return result;
}

GltfAccessor GltfData::positions(std::size_t accessor) { return read(accessor, "VEC3", 3, true); }

GltfAccessor GltfData::indices(std::size_t accessor) { return read(accessor, "SCALAR", 1, false); }

}  // namespace ttsdf

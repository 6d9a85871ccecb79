#pragma once
// The parts of a glTF file that hold numbers: json, buffers, views, accessors. Everything is held against
// what is there before it is read.

#include <json/json.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

struct GltfAccessor {
  std::size_t count = 0;
  std::vector<double> values;  ///< three for a position, one for an index
};

class GltfData {
 public:
  /// Throws std::runtime_error naming the file, or Json::Exception.
  explicit GltfData(const FileBytes& file);

  const Json::Value& json() const { return json_; }
  /// json()[list][number], an object.
  const Json::Value& item(const char* list, std::size_t number) const;
  std::size_t asNumber(const Json::Value& value, const char* what) const;
  std::size_t number(const Json::Value& object, const char* key, std::size_t otherwise) const;
  /// `count` finite numbers, or `otherwise` where the key is missing.
  std::vector<double> numbers(const Json::Value& object, const char* key, std::size_t count,
                              std::vector<double> otherwise) const;
  GltfAccessor positions(std::size_t accessor);
  GltfAccessor indices(std::size_t accessor);
  /// Of the file and of the buffers beside it.
  std::size_t bytesRead() const { return bytes_read_; }

 private:
  struct View {
    const char* begin = nullptr;
    std::size_t size = 0, stride = 0;  ///< 0: packed
  };

  void splitBinary();
  std::string fileOf(const std::string& uri) const;
  const std::string& buffer(std::size_t number);
  View view(std::size_t number);
  GltfAccessor read(std::size_t accessor, const char* type, std::size_t width, bool positions);
  /// Numbers of one type in a view, `width` each.
  void copy(const View& view, std::size_t offset, std::size_t component, std::size_t count, std::size_t width,
            const std::vector<std::size_t>* places, std::vector<double>& values) const;

  const FileBytes& file_;
  std::string text_, binary_;
  bool has_binary_ = false;
  Json::Value json_;
  std::map<std::size_t, std::string> buffers_;
  std::size_t bytes_read_ = 0;
};

}  // namespace ttsdf

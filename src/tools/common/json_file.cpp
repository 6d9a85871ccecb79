#include "ttsdf_localization/tools/json_file.h"

#include <json/reader.h>
#include <json/writer.h>

#include <memory>
#include <stdexcept>

#include "ttsdf_localization/files/file_writer.h"

namespace ttsdf {

Json::Value parseJson(const std::string& text, const std::string& what) {
  Json::Value root;
  std::string errors;
  const std::unique_ptr<Json::CharReader> reader(Json::CharReaderBuilder().newCharReader());
  if (!reader->parse(text.data(), text.data() + text.size(), &root, &errors)) {
    throw std::runtime_error(what + ": got no valid JSON: " + errors);
  }
  return root;
}

std::string toText(const Json::Value& value) {
  Json::StreamWriterBuilder builder;
  builder["indentation"] = "  ";
  builder["precision"] = 9;
  return Json::writeString(builder, value) + "\n";
}

void writeJson(const std::string& path, const Json::Value& value) {
  const std::string text = toText(value);
  writeFileAtomically(path, text.data(), text.size());
}

}  // namespace ttsdf

#pragma once

#include <json/value.h>

#include <string>

namespace ttsdf {

/// Throws std::runtime_error naming `what`.
Json::Value parseJson(const std::string& text, const std::string& what);
/// Indented, figures with nine digits.
std::string toText(const Json::Value& value);
/// Throws std::runtime_error naming the path.
void writeJson(const std::string& path, const Json::Value& value);

}  // namespace ttsdf

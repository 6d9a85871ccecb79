#include "ttsdf_localization/options/option_table.h"

#include <cstdlib>
#include <iomanip>
#include <limits>
#include <sstream>

namespace ttsdf {

namespace {
/// The shortest text that reads back as the same number.
std::string shortest(double value) {
  std::string text;
  for (int digits = 6; digits <= std::numeric_limits<double>::max_digits10; ++digits) {
    std::ostringstream out;
    out << std::setprecision(digits) << value;
    text = out.str();
    if (std::strtod(text.c_str(), nullptr) == value) break;
  }
  return text;
}
}  // namespace

std::string toString(const OptionValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* integer = std::get_if<int>(&value)) return std::to_string(*integer);
  if (const auto* number = std::get_if<double>(&value)) return shortest(*number);
  return std::get<std::string>(value);
}

namespace option_detail {

namespace {
const char* typeName(const OptionValue& value) {
  static const char* const kNames[] = {"true or false", "an integer", "a number", "a text"};
  return kNames[value.index()];
}
[[noreturn]] void wrongType(const std::string& name, const std::string& got, const OptionValue& like) {
  throw std::invalid_argument("option '" + name + "': got '" + got + "', wanted " + typeName(like));
}
}  // namespace

std::string rangeText(double min, double max, const std::vector<std::string>& choices) {
  std::ostringstream out;
  if (choices.empty()) {
    out << "a value from " << shortest(min) << " to " << shortest(max);
  } else {
    out << "one of";
    for (const auto& choice : choices) out << ' ' << choice;
  }
  return out.str();
}

OptionValue parse(const std::string& name, const std::string& text, const OptionValue& like) {
  if (std::holds_alternative<std::string>(like)) return text;
  if (std::holds_alternative<bool>(like)) {
    if (text == "true" || text == "1" || text == "yes") return true;
    if (text == "false" || text == "0" || text == "no") return false;
    wrongType(name, text, like);
  }
  try {
    std::size_t used = 0;
    OptionValue value;
    if (std::holds_alternative<int>(like)) {
      value = std::stoi(text, &used);
    } else {
      value = std::stod(text, &used);
    }
    if (used == text.size()) return value;
  } catch (const std::logic_error&) {
  }
  wrongType(name, text, like);
}

OptionValue convert(const std::string& name, const OptionValue& value, const OptionValue& like) {
  if (value.index() == like.index()) return value;
  if (std::holds_alternative<double>(like) && std::holds_alternative<int>(value)) {
    return static_cast<double>(std::get<int>(value));
  }
  wrongType(name, toString(value), like);
}

}  // namespace option_detail
}  // namespace ttsdf

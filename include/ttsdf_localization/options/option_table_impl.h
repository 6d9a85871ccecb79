#pragma once

#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

namespace option_detail {
std::string rangeText(double min, double max, const std::vector<std::string>& choices);
OptionValue parse(const std::string& name, const std::string& text, const OptionValue& like);
/// int -> double where `like` is a double; otherwise throws if the types differ.
OptionValue convert(const std::string& name, const OptionValue& value, const OptionValue& like);
}  // namespace option_detail

template <class Options>
OptionTable<Options>& OptionTable<Options>::append(Row row) {
  if (has(row.name))
    throw std::invalid_argument("option table: got '" + row.name + "' twice, wanted it once");
  rows_.push_back(std::move(row));
  return *this;
}

template <class Options>
OptionTable<Options>& OptionTable<Options>::add(std::string name, int Options::*member, int min, int max,
                                                std::string unit, std::string description) {
  return append({std::move(name),
                 std::move(unit),
                 static_cast<double>(min),
                 static_cast<double>(max),
                 {},
                 std::move(description),
                 [member](const Options& o) { return OptionValue(o.*member); },
                 [member](Options& o, const OptionValue& v) { o.*member = std::get<int>(v); }});
}

template <class Options>
OptionTable<Options>& OptionTable<Options>::add(std::string name, double Options::*member, double min,
                                                double max, std::string unit, std::string description) {
  return append({std::move(name),
                 std::move(unit),
                 min,
                 max,
                 {},
                 std::move(description),
                 [member](const Options& o) { return OptionValue(o.*member); },
                 [member](Options& o, const OptionValue& v) { o.*member = std::get<double>(v); }});
}

template <class Options>
OptionTable<Options>& OptionTable<Options>::add(std::string name, bool Options::*member,
                                                std::string description) {
  return append({std::move(name),
                 "",
                 0.0,
                 1.0,
                 {},
                 std::move(description),
                 [member](const Options& o) { return OptionValue(o.*member); },
                 [member](Options& o, const OptionValue& v) { o.*member = std::get<bool>(v); }});
}

template <class Options>
OptionTable<Options>& OptionTable<Options>::add(std::string name, std::string Options::*member,
                                                std::vector<std::string> choices, std::string description) {
  return append({std::move(name), "", 0.0, 0.0, std::move(choices), std::move(description),
                 [member](const Options& o) { return OptionValue(o.*member); },
                 [member](Options& o, const OptionValue& v) { o.*member = std::get<std::string>(v); }});
}

template <class Options>
template <class Nested>
OptionTable<Options>& OptionTable<Options>::add(Nested Options::*member, const OptionTable<Nested>& table) {
  for (const auto& row : table.rows()) {
    append({row.name, row.unit, row.min, row.max, row.choices, row.description,
            [member, get = row.get](const Options& o) { return get(o.*member); },
            [member, assign = row.assign](Options& o, const OptionValue& v) { assign(o.*member, v); }});
  }
  return *this;
}

template <class Options>
const typename OptionTable<Options>::Row* OptionTable<Options>::find(const std::string& name) const {
  for (const auto& row : rows_) {
    if (row.name == name) return &row;
  }
  return nullptr;
}

template <class Options>
void OptionTable<Options>::checkRange(const Row& row, const OptionValue& value) const {
  bool good = true;
  if (const auto* number = std::get_if<double>(&value)) {
    good = std::isfinite(*number) && *number >= row.min && *number <= row.max;
  } else if (const auto* integer = std::get_if<int>(&value)) {
    good = *integer >= row.min && *integer <= row.max;
  } else if (const auto* text = std::get_if<std::string>(&value)) {
    good = row.choices.empty();
    for (const auto& choice : row.choices) good = good || choice == *text;
  }
  if (!good) {
    throw std::invalid_argument("option '" + row.name + "': got " + toString(value) + ", wanted " +
                                option_detail::rangeText(row.min, row.max, row.choices) +
                                (row.unit.empty() ? "" : " [" + row.unit + "]"));
  }
}

template <class Options>
void OptionTable<Options>::set(Options& options, const std::string& name, const OptionValue& value) const {
  const Row* row = find(name);
  if (!row) {
    std::string known;
    for (const auto& r : rows_) known += (known.empty() ? "" : ", ") + r.name;
    throw std::invalid_argument("option '" + name + "' (value " + toString(value) +
                                ") is unknown; wanted one of: " + known);
  }
  const OptionValue converted = option_detail::convert(name, value, row->get(options));
  checkRange(*row, converted);
  row->assign(options, converted);
}

template <class Options>
void OptionTable<Options>::setFromText(Options& options, const std::string& name,
                                       const std::string& text) const {
  const Row* row = find(name);
  set(options, name, row ? option_detail::parse(name, text, row->get(options)) : OptionValue(text));
}

template <class Options>
void OptionTable<Options>::validate(const Options& options) const {
  for (const auto& row : rows_) checkRange(row, row.get(options));
}

}  // namespace ttsdf

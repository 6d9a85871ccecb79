#pragma once
// One table per option struct: name, member, unit, range, sentence. It feeds the rosparam loader, the YAML
// files, the command line, the validation and the generated parameter page, so that a default stands in one
// place only.

#include <functional>
#include <string>
#include <variant>
#include <vector>

namespace ttsdf {

using OptionValue = std::variant<bool, int, double, std::string>;

/// "true", "12", "0.5" or the text itself; a number's text reads back as the same number.
std::string toString(const OptionValue& value);

template <class Options>
class OptionTable {
 public:
  struct Row {
    std::string name;                  ///< member name = YAML key = command-line flag (with '-' for '_')
    std::string unit;                  ///< "m", "rad", "s", "" ...
    double min = 0.0, max = 0.0;       ///< range of numbers
    std::vector<std::string> choices;  ///< allowed texts; empty: any
    std::string description;
    std::function<OptionValue(const Options&)> get;
    std::function<void(Options&, const OptionValue&)> assign;
  };

  /// Throws std::invalid_argument for a name that is taken, as do all of these.
  OptionTable& add(std::string name, int Options::*member, int min, int max, std::string unit,
                   std::string description);
  OptionTable& add(std::string name, double Options::*member, double min, double max, std::string unit,
                   std::string description);
  OptionTable& add(std::string name, bool Options::*member, std::string description);
  OptionTable& add(std::string name, std::string Options::*member, std::vector<std::string> choices,
                   std::string description);
  /// Adds every row of a nested struct's table, reading and writing through `member`.
  template <class Nested>
  OptionTable& add(Nested Options::*member, const OptionTable<Nested>& table);

  const std::vector<Row>& rows() const { return rows_; }
  bool has(const std::string& name) const { return find(name) != nullptr; }
  /// Sets one option. Throws std::invalid_argument naming key, value and range for an unknown key, a wrong
  /// type or a value out of range. Integers are accepted where a double is wanted.
  void set(Options& options, const std::string& name, const OptionValue& value) const;
  /// The same from text ("0.5", "true", "search").
  void setFromText(Options& options, const std::string& name, const std::string& text) const;
  /// Checks every value of a filled struct.
  void validate(const Options& options) const;

 private:
  OptionTable& append(Row row);
  const Row* find(const std::string& name) const;
  void checkRange(const Row& row, const OptionValue& value) const;
  std::vector<Row> rows_;
};

}  // namespace ttsdf

#include "ttsdf_localization/options/option_table_impl.h"

#pragma once
// The command line that every tool shares: flags of its own, and every row of an option table as a flag
// (`--voxel-size` is voxel_size), with `--config FILE.yaml` underneath. Command line beats file beats
// default.

#include <functional>
#include <iosfwd>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

/// The command line (or a key of the option file) is wrong; a tool answers with exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class CommandLine {
 public:
  /// `synopsis` is what follows the program's name in the usage line; `summary` one sentence.
  CommandLine(std::string program, std::string synopsis, std::string summary);
  ~CommandLine();

  /// `--name PLACEHOLDER`; the target's value now is the default. Targets must outlive parse().
  CommandLine& value(const std::string& name, const std::string& placeholder, std::string& target,
                     const std::string& description);
  CommandLine& value(const std::string& name, const std::string& placeholder, int& target,
                     const std::string& description);
  CommandLine& value(const std::string& name, const std::string& placeholder, double& target,
                     const std::string& description);
  /// May be given many times, and takes several words each time.
  CommandLine& value(const std::string& name, const std::string& placeholder,
                     std::vector<std::string>& target, const std::string& description);
  /// `--name` without a value.
  CommandLine& flag(const std::string& name, bool& target, const std::string& description);
  /// The next argument without a flag. Required.
  CommandLine& positional(const std::string& placeholder, std::string& target);
  /// The rest of the arguments without a flag, at least one. Only once, and last.
  CommandLine& positionals(const std::string& placeholder, std::vector<std::string>& target);

  /// Every row of a table. A name in several tables sets all of them; in the option file the key may stand
  /// alone or below the section's name. Throws std::logic_error if the tool has a flag of such a name.
  template <class Options>
  CommandLine& options(const std::string& section, const OptionTable<Options>& table, Options& target);

  /// Fills the targets. Returns false after `--help`, whose text went to `out`. Throws UsageError.
  bool parse(int argc, const char* const* argv, std::ostream& out);
  /// True if `--name` stood on the command line.
  bool given(const std::string& name) const;
  std::string helpText() const;

 private:
  struct TableRow {
    std::string name, help;
  };
  struct Section {
    std::string name;
    std::vector<TableRow> rows;
    std::function<void(const std::string& name, const std::string& text)> set;
  };
  struct Impl;

  void addSection(Section section);
  static std::string rowHelp(const std::string& unit, const std::string& description,
                             const OptionValue& value, double min, double max,
                             const std::vector<std::string>& choices);
  std::unique_ptr<Impl> impl_;
};

/// Runs a tool's body; errors become one line on stderr and an exit code: UsageError 2, any other
/// exception 1.
int runTool(const std::string& program, const std::function<int()>& body);

/// "a,b,c" to exactly `count` numbers. Throws UsageError naming the flag.
std::vector<double> parseNumbers(const std::string& flag, const std::string& text, std::size_t count);
/// "a,b,c" to any number of numbers, at least one. Throws UsageError naming the flag.
std::vector<double> parseNumberList(const std::string& flag, const std::string& text);

template <class Options>
CommandLine& CommandLine::options(const std::string& section, const OptionTable<Options>& table,
                                  Options& target) {
  Section rows{section, {}, [&table, &target](const std::string& name, const std::string& text) {
                 table.setFromText(target, name, text);
               }};
  for (const auto& row : table.rows()) {
    rows.rows.push_back(
        {row.name, rowHelp(row.unit, row.description, row.get(target), row.min, row.max, row.choices)});
  }
  addSection(std::move(rows));
  return *this;
}

}  // namespace ttsdf

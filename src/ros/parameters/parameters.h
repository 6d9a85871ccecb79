#pragma once
// rosparam -> option structs, by their tables. A key nobody knows and a value out of range are errors, all
// reported at once.

#include <ros/node_handle.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

/// Throws std::invalid_argument for lists, structs and dates. `key` is for the message.
OptionValue optionValue(const std::string& key, XmlRpc::XmlRpcValue value);

namespace parameter_detail {
/// "Sentence. [m] 0 to 10", "Sentence. one | two".
std::string comment(const std::string& description, const std::string& unit, double min, double max,
                    const std::vector<std::string>& choices, const OptionValue& value);
}  // namespace parameter_detail

/// What a node reads from its private namespace.
class ParameterSet {
 public:
  struct Entry {
    std::string group, name;
    std::string description, unit;
    double min = 0.0, max = 0.0;       ///< range of numbers
    std::vector<std::string> choices;  ///< allowed texts; empty: any
    std::string comment;               ///< what it means, unit and range
    std::function<OptionValue()> get;
    std::function<void(const OptionValue&)> set;  ///< throws std::invalid_argument
    std::string key() const { return group.empty() ? name : group + "/" + name; }
  };

  /// Registers every option of `options` (which must outlive this) below `group` ("" or "registration" ...).
  template <class Options>
  void add(const std::string& group, Options& options, const OptionTable<Options>& table) {
    for (const auto& row : table.rows()) {
      Entry entry;
      entry.group = group;
      entry.name = row.name;
      entry.description = row.description;
      entry.unit = row.unit;
      entry.min = row.min;
      entry.max = row.max;
      entry.choices = row.choices;
      entry.comment = parameter_detail::comment(row.description, row.unit, row.min, row.max, row.choices,
                                                row.get(options));
      entry.get = [&options, get = row.get] { return get(options); };
      entry.set = [&options, &table, name = row.name](const OptionValue& value) {
        table.set(options, name, value);
      };
      entries_.push_back(std::move(entry));
    }
  }
  /// A key that belongs to somebody else in this namespace.
  void ignore(const std::string& key) { ignored_.push_back(key); }

  /// Reads every parameter below the handle's namespace. Throws std::invalid_argument with one line per bad
  /// key: key, value and range, or, for a misspelt key, the known one most like it. What is like none of them
  /// belongs to somebody else and is left alone, with a warning.
  void load(const ros::NodeHandle& private_node) const;
  /// The same from a value (for tests and for bags).
  void load(const XmlRpc::XmlRpcValue& tree, const std::string& where) const;

  std::vector<std::string> keys() const;
  const std::vector<Entry>& entries() const { return entries_; }
  /// Null for a key nobody knows.
  const Entry* find(const std::string& key) const;

  /// A YAML file with every option, its value and what it means. `title` and `group_comments` (by group; ""
  /// is the top) are plain text, put into comments.
  std::string toYaml(const std::string& title,
                     const std::map<std::string, std::string>& group_comments) const;

 private:
  void visit(const XmlRpc::XmlRpcValue& tree, const std::string& prefix,
             std::vector<std::string>& problems) const;
  /// Throws for what looks like a misspelt key of ours; warns of any other.
  static void refuseOrLeave(const std::string& key, const std::string& nearest_key);
  bool isGroup(const std::string& key) const;
  std::vector<std::string> groups() const;

  std::vector<Entry> entries_;
  std::vector<std::string> ignored_;
};

/// Options of a node that has one table only. Throws as ParameterSet::load does.
template <class Options>
Options loadOptions(const OptionTable<Options>& table, const ros::NodeHandle& private_node) {
  Options options;
  ParameterSet set;
  set.add("", options, table);
  set.load(private_node);
  return options;
}

}  // namespace ttsdf

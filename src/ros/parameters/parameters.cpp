#include "ros/parameters/parameters.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <locale>
#include <numeric>
#include <sstream>
#include <stdexcept>

namespace ttsdf {

namespace {

/// Levenshtein distance, to point at the key that was probably meant.
std::size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row.back();
}

std::string nearest(const std::string& key, const std::vector<std::string>& all) {
  return *std::min_element(all.begin(), all.end(), [&](const std::string& a, const std::string& b) {
    return editDistance(key, a) < editDistance(key, b);
  });
}

/// What YAML makes of a number is not always a number: `1e-4` is a text for rosparam, and `5000.0` no
/// integer.
OptionValue asTypeOf(const OptionValue& wanted, OptionValue value) {
  const bool number = std::holds_alternative<int>(wanted) || std::holds_alternative<double>(wanted);
  if (const auto* text = std::get_if<std::string>(&value); text && number) {
    std::istringstream in(*text);
    in.imbue(std::locale::classic());
    double parsed = 0.0;
    if (in >> parsed && in.peek() == std::istringstream::traits_type::eof()) value = parsed;
  }
  if (const auto* real = std::get_if<double>(&value); real && std::holds_alternative<int>(wanted)) {
    if (*real == std::floor(*real) && std::abs(*real) <= std::numeric_limits<int>::max())
      value = static_cast<int>(*real);
  }
  return value;
}

std::string number(double value) {
  std::ostringstream out;
  out << std::setprecision(10) << value;
  return out.str();
}

std::string yamlScalar(const OptionValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return '"' + *text + '"';
  if (const auto* real = std::get_if<double>(&value)) {
    const std::string text = number(*real);
    return text.find_first_of(".e") == std::string::npos ? text + ".0"
                                                         : text;  // or rosparam reads an integer
  }
  return toString(value);
}

/// Wraps plain text into comment lines of at most 110 characters; a line break in the text stays one.
void writeComment(std::ostream& out, const std::string& indent, const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string word, written = indent + "#";
    while (words >> word) {
      if (written.size() + 1 + word.size() > 110) {
        out << written << '\n';
        written = indent + "#";
      }
      written += " " + word;
    }
    out << written << '\n';
  }
}

}  // namespace

namespace parameter_detail {

std::string comment(const std::string& description, const std::string& unit, double min, double max,
                    const std::vector<std::string>& choices, const OptionValue& value) {
  std::string text = description;
  if (!unit.empty()) text += " [" + unit + "]";
  if (!choices.empty()) {
    std::string all;
    for (const std::string& choice : choices) all += (all.empty() ? "" : " | ") + choice;
    text += " (" + all + ")";
  } else if (std::holds_alternative<int>(value) || std::holds_alternative<double>(value)) {
    text += " (" + number(min) + " to " + number(max) + ")";
  }
  return text;
}

}  // namespace parameter_detail

OptionValue optionValue(const std::string& key, XmlRpc::XmlRpcValue value) {
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return static_cast<bool>(value);
    case XmlRpc::XmlRpcValue::TypeInt:
      return static_cast<int>(value);
    case XmlRpc::XmlRpcValue::TypeDouble:
      return static_cast<double>(value);
    case XmlRpc::XmlRpcValue::TypeString:
      return static_cast<std::string>(value);
    default:
      throw std::invalid_argument("option '" + key + "': got " + value.toXml() +
                                  ", wanted true or false, a number or a text");
  }
}

void ParameterSet::load(const ros::NodeHandle& private_node) const {
  XmlRpc::XmlRpcValue tree;
  if (private_node.getParam(private_node.getNamespace(), tree)) load(tree, private_node.getNamespace());
}

void ParameterSet::load(const XmlRpc::XmlRpcValue& tree, const std::string& where) const {
  std::vector<std::string> problems;
  visit(tree, "", problems);
  if (problems.empty()) return;
  std::string text = "bad parameters in " + where + ":";
  for (const std::string& problem : problems) text += "\n  " + problem;
  throw std::invalid_argument(text);
}

void ParameterSet::visit(const XmlRpc::XmlRpcValue& tree, const std::string& prefix,
                         std::vector<std::string>& problems) const {
  XmlRpc::XmlRpcValue node = tree;  // iteration is not const in xmlrpcpp
  if (node.getType() != XmlRpc::XmlRpcValue::TypeStruct) return;
  for (auto& entry : node) {
    const std::string key = prefix + entry.first;
    if (std::find(ignored_.begin(), ignored_.end(), key) != ignored_.end()) continue;
    const Entry* known = find(key);
    try {
      if (entry.second.getType() == XmlRpc::XmlRpcValue::TypeStruct && !known) {
        if (isGroup(key)) {
          visit(entry.second, key + "/", problems);
        } else {
          const auto known_groups = groups();
          if (!known_groups.empty()) refuseOrLeave(key, nearest(key, known_groups));
        }
      } else if (isGroup(key)) {
        throw std::invalid_argument("option '" + key + "': got " + entry.second.toXml() +
                                    ", wanted options below it");
      } else if (known) {
        known->set(asTypeOf(known->get(), optionValue(key, entry.second)));
      } else if (!prefix.empty()) {  // a group is ours alone
        throw std::invalid_argument("option '" + key + "' is unknown; did you mean '" + nearest(key, keys()) +
                                    "'?");
      } else {
        refuseOrLeave(key, nearest(key, keys()));
      }
    } catch (const std::invalid_argument& error) {
      problems.push_back(prefix.empty() || !known ? error.what() : prefix + ": " + error.what());
    }
  }
}

void ParameterSet::refuseOrLeave(const std::string& key, const std::string& nearest_key) {
  // Other nodes keep their parameters below our name, too (localization/ekf/frequency, num_worker_threads);
  // what looks like a slip of the pen is ours.
  if (editDistance(key, nearest_key) <= std::max<std::size_t>(3, key.size() / 3))
    throw std::invalid_argument("option '" + key + "' is unknown; did you mean '" + nearest_key + "'?");
  ROS_WARN_STREAM("parameter '" << key << "' is none of this node's and is left alone");
}

bool ParameterSet::isGroup(const std::string& key) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& entry) { return entry.group == key; });
}

const ParameterSet::Entry* ParameterSet::find(const std::string& key) const {
  for (const Entry& entry : entries_) {
    if (entry.key() == key) return &entry;
  }
  return nullptr;
}

std::vector<std::string> ParameterSet::groups() const {
  std::vector<std::string> groups;
  for (const Entry& entry : entries_) {
    if (!entry.group.empty()) groups.push_back(entry.group);
  }
  return groups;
}

std::vector<std::string> ParameterSet::keys() const {
  std::vector<std::string> keys;
  for (const Entry& entry : entries_) keys.push_back(entry.key());
  return keys;
}

std::string ParameterSet::toYaml(const std::string& title,
                                 const std::map<std::string, std::string>& group_comments) const {
  std::ostringstream out;
  writeComment(out, "", title);
  std::string group;
  bool first = true;
  for (const Entry& entry : entries_) {
    if (first || entry.group != group) {
      group = entry.group;
      first = false;
      out << '\n';
      const auto comment = group_comments.find(group);
      if (comment != group_comments.end()) writeComment(out, "", comment->second);
      if (!group.empty()) out << group << ":\n";
    }
    const std::string indent = group.empty() ? "" : "  ";
    out << indent << entry.name << ": " << yamlScalar(entry.get()) << '\n';
    writeComment(out, indent + "  ", entry.comment);
  }
  return out.str();
}

}  // namespace ttsdf

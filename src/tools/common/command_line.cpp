#include "ttsdf_localization/tools/command_line.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <iostream>
#include <set>
#include <sstream>

#include "ttsdf_localization/tools/option_file.h"
#include "ttsdf_localization/tools/printable.h"

namespace ttsdf {

namespace po = boost::program_options;

namespace {

constexpr unsigned kHelpWidth = 110;
constexpr const char* kConfigFlag = "config";

std::string flagName(std::string option_name) {
  std::replace(option_name.begin(), option_name.end(), '_', '-');
  return option_name;
}

void writeRange(std::ostream& out, double min, double max, const std::vector<std::string>& choices) {
  if (choices.empty()) {
    out << min << " to " << max;
    return;
  }
  for (std::size_t i = 0; i < choices.size(); ++i) out << (i ? " | " : "") << choices[i];
}

}  // namespace

struct CommandLine::Impl {
  struct Positional {
    std::string placeholder;
    std::string* single = nullptr;
    std::vector<std::string>* many = nullptr;
  };

  std::string program, synopsis, summary, config;
  po::options_description general{"Flags", kHelpWidth};
  std::vector<Positional> positionals;
  std::vector<Section> sections;
  po::variables_map given;

  void add(const std::string& name, po::value_semantic* semantic, const std::string& description) {
    general.add_options()(name.c_str(), semantic, description.c_str());
  }
  void parseArguments(int argc, const char* const* argv);
  void assignPositionals();
  void applyConfig();
  void applyKey(const std::string& section, const std::string& key, const YAML::Node& value);
  void applyFlags();
};

CommandLine::CommandLine(std::string program, std::string synopsis, std::string summary)
    : impl_(std::make_unique<Impl>()) {
  impl_->program = std::move(program);
  impl_->synopsis = std::move(synopsis);
  impl_->summary = std::move(summary);
  impl_->general.add_options()("help,h", "Print this text and stop.");
}

CommandLine::~CommandLine() = default;

CommandLine& CommandLine::value(const std::string& name, const std::string& placeholder, std::string& target,
                                const std::string& description) {
  const std::string suffix = target.empty() ? "" : " (default " + target + ")";
  impl_->add(name, po::value<std::string>(&target)->value_name(placeholder), description + suffix);
  return *this;
}

CommandLine& CommandLine::value(const std::string& name, const std::string& placeholder, int& target,
                                const std::string& description) {
  impl_->add(name, po::value<int>(&target)->value_name(placeholder),
             description + " (default " + std::to_string(target) + ")");
  return *this;
}

CommandLine& CommandLine::value(const std::string& name, const std::string& placeholder, double& target,
                                const std::string& description) {
  std::ostringstream text;
  text << description << " (default " << target << ")";
  impl_->add(name, po::value<double>(&target)->value_name(placeholder), text.str());
  return *this;
}

CommandLine& CommandLine::value(const std::string& name, const std::string& placeholder,
                                std::vector<std::string>& target, const std::string& description) {
  impl_->add(name,
             po::value<std::vector<std::string>>(&target)->value_name(placeholder)->multitoken()->composing(),
             description);
  return *this;
}

CommandLine& CommandLine::flag(const std::string& name, bool& target, const std::string& description) {
  impl_->add(name, po::bool_switch(&target), description);
  return *this;
}

CommandLine& CommandLine::positional(const std::string& placeholder, std::string& target) {
  impl_->positionals.push_back({placeholder, &target, nullptr});
  return *this;
}

CommandLine& CommandLine::positionals(const std::string& placeholder, std::vector<std::string>& target) {
  impl_->positionals.push_back({placeholder, nullptr, &target});
  return *this;
}

void CommandLine::addSection(Section section) {
  if (impl_->sections.empty()) {
    impl_->add(
        kConfigFlag, po::value<std::string>(&impl_->config)->value_name("FILE.yaml"),
        "Option file; its keys are the names of the options below with '_' for '-'. The command line wins.");
  }
  for (const auto& row : section.rows) {
    if (impl_->general.find_nothrow(flagName(row.name), false)) {
      throw std::logic_error("flag --" + flagName(row.name) + " of " + impl_->program + " hides option " +
                             row.name);
    }
  }
  impl_->sections.push_back(std::move(section));
}

std::string CommandLine::rowHelp(const std::string& unit, const std::string& description,
                                 const OptionValue& value, double min, double max,
                                 const std::vector<std::string>& choices) {
  std::ostringstream out;
  out << description << (unit.empty() ? "" : " [" + unit + "]") << " (default " << toString(value);
  const bool ranged =
      std::holds_alternative<int>(value) || std::holds_alternative<double>(value) || !choices.empty();
  if (ranged) {
    out << "; ";
    writeRange(out, min, max, choices);
  } else if (std::holds_alternative<bool>(value)) {
    out << "; true | false";
  }
  out << ")";
  return out.str();
}

std::string CommandLine::helpText() const {
  std::ostringstream out;
  out << "usage: " << impl_->program << ' ' << impl_->synopsis << "\n\n" << impl_->summary << "\n\n";
  out << impl_->general;
  for (const auto& section : impl_->sections) {
    po::options_description description("Options: " + section.name, kHelpWidth);
    for (const auto& row : section.rows) {
      description.add_options()(flagName(row.name).c_str(), po::value<std::string>()->value_name("VALUE"),
                                row.help.c_str());
    }
    out << '\n' << description;
  }
  return out.str();
}

bool CommandLine::parse(int argc, const char* const* argv, std::ostream& out) {
  impl_->parseArguments(argc, argv);
  if (given("help")) {
    out << helpText();
    return false;
  }
  try {
    po::notify(impl_->given);
  } catch (const po::error& error) {
    throw UsageError(error.what());
  }
  impl_->assignPositionals();
  impl_->applyConfig();
  impl_->applyFlags();
  return true;
}

void CommandLine::Impl::parseArguments(int argc, const char* const* argv) {
  given = {};
  po::options_description all;
  all.add(general);
  std::set<std::string> names;
  for (const auto& section : sections) {
    for (const auto& row : section.rows) {
      if (names.insert(row.name).second)
        all.add_options()(flagName(row.name).c_str(), po::value<std::string>(), "");
    }
  }
  const std::string rest = " positional";  // a name that no flag can have
  all.add_options()(rest.c_str(), po::value<std::vector<std::string>>(), "");
  po::positional_options_description positional;
  const bool unlimited = !positionals.empty() && positionals.back().many;
  if (!positionals.empty())
    positional.add(rest.c_str(), unlimited ? -1 : static_cast<int>(positionals.size()));
  // No guessing: a mistyped flag is an error and never another flag.
  const int style = po::command_line_style::unix_style & ~po::command_line_style::allow_guessing;
  try {
    po::store(po::command_line_parser(argc, argv).options(all).positional(positional).style(style).run(),
              given);
  } catch (const po::too_many_positional_options_error&) {
    throw UsageError("too many arguments without a flag, wanted " + std::to_string(positionals.size()));
  } catch (const po::error& error) {
    throw UsageError(error.what());
  }
}

void CommandLine::Impl::assignPositionals() {
  std::vector<std::string> words;
  if (given.count(" positional")) words = given[" positional"].as<std::vector<std::string>>();
  std::size_t next = 0;
  for (const auto& positional : positionals) {
    if (next >= words.size()) throw UsageError("argument " + positional.placeholder + " is missing");
    if (positional.single) {
      *positional.single = words[next++];
    } else {
      positional.many->assign(words.begin() + static_cast<std::ptrdiff_t>(next), words.end());
      next = words.size();
    }
  }
}

void CommandLine::Impl::applyConfig() {
  if (config.empty()) return;
  const YAML::Node root = loadOptionFile(config);
  if (root.IsNull()) return;
  if (!root.IsMap()) throw UsageError("option file '" + config + "': got no map of keys to values");
  try {
    for (const auto& entry : root) {
      const auto key = entry.first.as<std::string>();
      if (!entry.second.IsMap()) {
        applyKey("", key, entry.second);
        continue;
      }
      for (const auto& nested : entry.second) applyKey(key, nested.first.as<std::string>(), nested.second);
    }
  } catch (const YAML::Exception& error) {
    throw UsageError("option file '" + config + "': " + error.what());
  }
}

void CommandLine::Impl::applyKey(const std::string& section_name, const std::string& key,
                                 const YAML::Node& value) {
  const std::string full_key = section_name.empty() ? key : section_name + "/" + key;
  if (!value.IsScalar())
    throw UsageError("option file '" + config + "': key '" + full_key + "' has no plain value");
  bool known = false;
  for (const auto& section : sections) {
    if (!section_name.empty() && section.name != section_name) continue;
    const auto hasKey = [&key](const TableRow& row) { return row.name == key; };
    if (std::none_of(section.rows.begin(), section.rows.end(), hasKey)) continue;
    known = true;
    try {
      section.set(key, value.as<std::string>());
    } catch (const std::invalid_argument& error) {
      throw UsageError("option file '" + config + "': " + error.what());
    }
  }
  if (!known) throw UsageError("option file '" + config + "': key '" + full_key + "' is unknown");
}

void CommandLine::Impl::applyFlags() {
  for (const auto& section : sections) {
    for (const auto& row : section.rows) {
      const auto found = given.find(flagName(row.name));
      if (found == given.end()) continue;
      try {
        section.set(row.name, found->second.as<std::string>());
      } catch (const std::invalid_argument& error) {
        throw UsageError(error.what());
      }
    }
  }
}

bool CommandLine::given(const std::string& name) const {
  const auto found = impl_->given.find(name);
  return found != impl_->given.end() && !found->second.defaulted();
}

int runTool(const std::string& program, const std::function<int()>& body) {
  try {
    return body();
  } catch (const UsageError& error) {
    std::cerr << program << ": error: " << printable(error.what()) << " (see " << program << " --help)\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << program << ": error: " << printable(error.what()) << '\n';
    return 1;
  }
}

std::vector<double> parseNumberList(const std::string& flag, const std::string& text) {
  std::vector<double> numbers;
  std::stringstream words(text);
  std::string word;
  while (std::getline(words, word, ',')) {
    std::size_t used = 0;
    double number = 0.0;
    try {
      number = std::stod(word, &used);
    } catch (const std::logic_error&) {
      used = std::string::npos;
    }
    if (used != word.size())
      throw UsageError("--" + flag + ": got '" + text + "', wanted numbers with commas between");
    numbers.push_back(number);
  }
  if (numbers.empty())
    throw UsageError("--" + flag + ": got '" + text + "', wanted numbers with commas between");
  return numbers;
}

std::vector<double> parseNumbers(const std::string& flag, const std::string& text, std::size_t count) {
  auto numbers = parseNumberList(flag, text);
  if (numbers.size() != count) {
    throw UsageError("--" + flag + ": got '" + text + "', wanted " + std::to_string(count) +
                     " numbers with commas between");
  }
  return numbers;
}

}  // namespace ttsdf

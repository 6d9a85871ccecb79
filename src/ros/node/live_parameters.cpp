#include "ros/node/live_parameters.h"

#include <map>
#include <stdexcept>
#include <utility>
#include <variant>

namespace ttsdf {

namespace {

using dynamic_reconfigure::Config;
using dynamic_reconfigure::ConfigDescription;

/// Appends one value to the list of its type.
void append(Config& config, const std::string& name, const OptionValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) {
    config.bools.emplace_back();
    config.bools.back().name = name;
    config.bools.back().value = *flag;
  } else if (const auto* integer = std::get_if<int>(&value)) {
    config.ints.emplace_back();
    config.ints.back().name = name;
    config.ints.back().value = *integer;
  } else if (const auto* number = std::get_if<double>(&value)) {
    config.doubles.emplace_back();
    config.doubles.back().name = name;
    config.doubles.back().value = *number;
  } else {
    config.strs.emplace_back();
    config.strs.back().name = name;
    config.strs.back().value = std::get<std::string>(value);
  }
}

/// The end of the range; for a flag and a text the value itself says nothing.
OptionValue bound(const ParameterSet::Entry& entry, bool upper) {
  const double end = upper ? entry.max : entry.min;
  const OptionValue value = entry.get();
  if (std::holds_alternative<bool>(value)) return upper;
  if (std::holds_alternative<int>(value)) return static_cast<int>(end);
  if (std::holds_alternative<double>(value)) return end;
  return std::string();
}

const char* typeName(const OptionValue& value) {
  if (std::holds_alternative<bool>(value)) return "bool";
  if (std::holds_alternative<int>(value)) return "int";
  if (std::holds_alternative<double>(value)) return "double";
  return "str";
}

/// Group names in the order of the file; their index is their id, "Default" holds what has no group.
std::vector<std::string> groupNames(const ParameterSet& set) {
  std::vector<std::string> names{"Default"};
  for (const auto& entry : set.entries()) {
    if (isLive(entry.key()) && !entry.group.empty() && entry.group != names.back())
      names.push_back(entry.group);
  }
  return names;
}

void setGroups(const std::vector<std::string>& names, Config& config) {
  for (std::size_t id = 0; id < names.size(); ++id) {
    config.groups.emplace_back();
    config.groups.back().name = names[id];
    config.groups.back().state = true;
    config.groups.back().id = static_cast<int>(id);
  }
}

}  // namespace

ConfigDescription liveDescription() {
  LocalizationRosOptions defaults;
  const ParameterSet set = localizationParameters(defaults);
  const std::vector<std::string> names = groupNames(set);
  ConfigDescription description;
  std::map<std::string, std::size_t> ids;
  for (std::size_t id = 0; id < names.size(); ++id) {
    description.groups.emplace_back();
    description.groups.back().name = names[id];
    description.groups.back().id = static_cast<int>(id);
    ids[names[id]] = id;
  }
  for (Config* config : {&description.min, &description.max, &description.dflt}) setGroups(names, *config);
  for (const auto& entry : set.entries()) {
    if (!isLive(entry.key())) continue;
    dynamic_reconfigure::ParamDescription parameter;
    parameter.name = entry.key();
    parameter.type = typeName(entry.get());
    parameter.description = entry.comment;
    description.groups[ids[entry.group.empty() ? "Default" : entry.group]].parameters.push_back(parameter);
    append(description.min, entry.key(), bound(entry, false));
    append(description.max, entry.key(), bound(entry, true));
    append(description.dflt, entry.key(), entry.get());
  }
  return description;
}

Config liveConfig(const LocalizationRosOptions& options) {
  LocalizationRosOptions values = options;
  const ParameterSet set = localizationParameters(values);
  Config config;
  setGroups(groupNames(set), config);
  for (const auto& entry : set.entries()) {
    if (isLive(entry.key())) append(config, entry.key(), entry.get());
  }
  return config;
}

LocalizationRosOptions withLiveValues(const LocalizationRosOptions& options, const Config& config) {
  LocalizationRosOptions changed = options;
  const ParameterSet set = localizationParameters(changed);
  const auto assign = [&set](const std::string& name, const OptionValue& value) {
    const ParameterSet::Entry* entry = set.find(name);
    if (!entry) throw std::invalid_argument("option '" + name + "' is unknown");
    if (!isLive(name)) {
      throw std::invalid_argument("option '" + name +
                                  "' cannot change while the localizer runs: set it and start again");
    }
    entry->set(value);
  };
  for (const auto& value : config.bools) assign(value.name, static_cast<bool>(value.value));
  for (const auto& value : config.ints) assign(value.name, static_cast<int>(value.value));
  for (const auto& value : config.doubles) assign(value.name, value.value);
  for (const auto& value : config.strs) assign(value.name, value.value);
  checkAndTidy(changed);
  return changed;
}

LiveParameters::LiveParameters(const ros::NodeHandle& private_node, const LocalizationRosOptions& options,
                               Apply apply)
    : private_node_(private_node), apply_(std::move(apply)), options_(options) {
  descriptions_ = private_node_.advertise<ConfigDescription>("parameter_descriptions", 1, true);
  updates_ = private_node_.advertise<Config>("parameter_updates", 1, true);
  descriptions_.publish(liveDescription());
  updates_.publish(liveConfig(options_));
  service_ = private_node_.advertiseService("set_parameters", &LiveParameters::set, this);
}

void LiveParameters::shutdown() { service_.shutdown(); }

bool LiveParameters::set(dynamic_reconfigure::Reconfigure::Request& request,
                         dynamic_reconfigure::Reconfigure::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  try {
    const LocalizationRosOptions changed = withLiveValues(options_, request.config);
    apply_(changed);
    options_ = changed;
  } catch (const std::exception& error) {
    // A refusal, not a clamped value: roscpp sends the text of the exception to the caller.
    ROS_ERROR_STREAM(private_node_.getNamespace() << "/set_parameters refused: " << error.what());
    throw;
  }
  response.config = liveConfig(options_);
  updates_.publish(response.config);
  remember(request.config);
  return true;
}

void LiveParameters::remember(const Config& config) const {
  // The parameter server says what is in use, so that rosparam dump writes it.
  for (const auto& value : config.bools) private_node_.setParam(value.name, static_cast<bool>(value.value));
  for (const auto& value : config.ints) private_node_.setParam(value.name, value.value);
  for (const auto& value : config.doubles) private_node_.setParam(value.name, value.value);
  for (const auto& value : config.strs) private_node_.setParam(value.name, value.value);
}

}  // namespace ttsdf

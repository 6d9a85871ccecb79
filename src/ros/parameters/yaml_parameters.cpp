#include "ros/parameters/yaml_parameters.h"

#include <yaml-cpp/yaml.h>

#include <stdexcept>

#include "ttsdf_localization/yaml/plain_yaml.h"

namespace ttsdf {

namespace {

constexpr int kMostNodes = 10000;  // aliases of aliases multiply

XmlRpc::XmlRpcValue fromYaml(const YAML::Node& node, int& left);

/// Types as rosparam guesses them: a quoted text is a text, even if it looks like a number.
XmlRpc::XmlRpcValue scalar(const YAML::Node& node) {
  bool flag;
  int integer;
  double number;
  if (node.Tag() == "!") return XmlRpc::XmlRpcValue(node.as<std::string>());
  if (YAML::convert<int>::decode(node, integer)) return XmlRpc::XmlRpcValue(integer);
  if (YAML::convert<double>::decode(node, number)) return XmlRpc::XmlRpcValue(number);
  if (YAML::convert<bool>::decode(node, flag)) return XmlRpc::XmlRpcValue(flag);
  return XmlRpc::XmlRpcValue(node.as<std::string>());
}

XmlRpc::XmlRpcValue fromYaml(const YAML::Node& node, int& left) {
  if (--left < 0) throw std::runtime_error("got values within values without end, wanted keys and values");
  XmlRpc::XmlRpcValue value;
  if (node.IsMap()) {
    for (const auto& entry : node) value[entry.first.as<std::string>()] = fromYaml(entry.second, left);
  } else if (node.IsSequence()) {
    value.setSize(static_cast<int>(node.size()));
    for (std::size_t n = 0; n < node.size(); ++n) value[static_cast<int>(n)] = fromYaml(node[n], left);
  } else if (node.IsScalar()) {
    value = scalar(node);
  } else {
    value = std::string();
  }
  return value;
}

}  // namespace

XmlRpc::XmlRpcValue parametersFromFile(const std::string& path) {
  constexpr std::size_t kMostBytes = 1 << 20;
  const YAML::Node root = loadPlainYaml("parameter file", path, kMostBytes, Aliases::kAllowed);
  try {
    if (root.IsNull()) return {};
    if (!root.IsMap()) throw std::runtime_error("got no map of keys to values");
    int left = kMostNodes;
    return fromYaml(root, left);
  } catch (const std::exception& error) {
    throw std::runtime_error("parameter file '" + path + "': " + error.what());
  }
}

void setParameter(XmlRpc::XmlRpcValue& tree, const std::string& assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw std::invalid_argument("got '" + assignment +
                                "', wanted KEY=VALUE, for example gates/min_inlier_ratio=0.3");
  }
  const std::string key = assignment.substr(0, equals);
  XmlRpc::XmlRpcValue value;
  try {
    int left = kMostNodes;
    value = fromYaml(plainYaml("", assignment.substr(equals + 1), Aliases::kAllowed), left);
  } catch (const std::exception& error) {
    throw std::invalid_argument("got '" + assignment + "': " + error.what());
  }
  const std::size_t slash = key.find('/');
  if (slash == std::string::npos) {
    tree[key] = value;
  } else {
    tree[key.substr(0, slash)][key.substr(slash + 1)] = value;
  }
}

}  // namespace ttsdf

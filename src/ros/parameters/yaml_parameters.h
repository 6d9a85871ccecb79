#pragma once
// Parameters from a YAML file, as rosparam would put them on the parameter server: for programs that run
// without one.

#include <XmlRpcValue.h>

#include <string>

namespace ttsdf {

/// Throws std::runtime_error for a file that cannot be read or is no map of keys to values.
XmlRpc::XmlRpcValue parametersFromFile(const std::string& path);
/// Adds "group/name=value" to a tree; the value is YAML. Throws std::invalid_argument without a '='.
void setParameter(XmlRpc::XmlRpcValue& tree, const std::string& assignment);

}  // namespace ttsdf

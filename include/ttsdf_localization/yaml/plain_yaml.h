#pragma once
// YAML files of others, read with bounds.

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <string>

namespace ttsdf {

/// The one document of a YAML file. Throws std::runtime_error that begins with `what` and the path:
/// unreadable, larger than `max_bytes`, nested deeper than 16 levels, anchors and aliases (with which a few
/// bytes become a cycle or gigabytes), not YAML.
YAML::Node loadPlainYaml(const std::string& what, const std::string& path, std::size_t max_bytes);

}  // namespace ttsdf

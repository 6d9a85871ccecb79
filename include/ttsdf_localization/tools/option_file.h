#pragma once
// Option files (YAML), read with bounds.

#include <yaml-cpp/yaml.h>

#include <string>

namespace ttsdf {

/// The one document of a YAML file. Throws std::runtime_error naming the file: unreadable, larger than a
/// megabyte, nested deeper than options ever are, anchors and aliases (with which a few bytes become a cycle
/// or gigabytes), not YAML.
YAML::Node loadOptionFile(const std::string& path);

}  // namespace ttsdf

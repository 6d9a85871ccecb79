#pragma once
// YAML files of others, read with bounds.

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <string>

namespace ttsdf {

/// Anchors and aliases: with them a few bytes become a cycle or gigabytes.
enum class Aliases {
  kRefused,
  kAllowed,  ///< but for those of what holds them; the caller bounds what they become
};

/// The one document of a text, null if there is none. Throws std::runtime_error that begins with `what` and
/// names the line: not YAML, nested deeper than 16 levels, aliases, a second document.
YAML::Node plainYaml(const std::string& what, const std::string& text, Aliases aliases = Aliases::kRefused);

/// The same of a file: unreadable or larger than `max_bytes` is an error as well; messages begin with `what`
/// and the path.
YAML::Node loadPlainYaml(const std::string& what, const std::string& path, std::size_t max_bytes,
                         Aliases aliases = Aliases::kRefused);

}  // namespace ttsdf

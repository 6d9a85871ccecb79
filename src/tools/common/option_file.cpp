#include "ttsdf_localization/tools/option_file.h"

#include "ttsdf_localization/yaml/plain_yaml.h"

namespace ttsdf {

YAML::Node loadOptionFile(const std::string& path) {
  constexpr std::size_t kMostBytes = 1 << 20;
  return loadPlainYaml("option file", path, kMostBytes);
}

}  // namespace ttsdf

#include <ttsdf_localization/localization/localizer.h>
#include <ttsdf_localization/map/map_io.h>
#include <ttsdf_localization/ros/localization_ros.h>

int main() {
  ttsdf::LocalizationRosOptions options;
  ttsdf::checkAndTidy(options);
  const ttsdf::Localizer localizer(options.localizer);
  return localizer.hasMap() || ttsdf::localizationYaml().empty() ? 1 : 0;
}

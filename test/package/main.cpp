#include <ttsdf_localization/LocalizationStatus.h>
#include <ttsdf_localization/localization/localizer.h>
#include <ttsdf_localization/map/map_io.h>

int main() {
  const ttsdf_localization::LocalizationStatus status;
  const ttsdf::Localizer localizer;
  return localizer.hasMap() || status.pose_valid ? 1 : 0;
}

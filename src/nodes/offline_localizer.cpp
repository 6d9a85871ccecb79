#include "ros/offline/offline_run.h"
#include "ttsdf_localization/tools/command_line.h"

int main(int argc, char** argv) {
  return ttsdf::runTool("offline_localizer", [&] { return ttsdf::runOfflineLocalizer(argc, argv); });
}

// index: looks around in the maps, so that robots need not.

#include <cstdio>
#include <iostream>
#include <stdexcept>

#include "atlas_commands.h"
#include "ttsdf_localization/atlas/atlas_locator.h"
#include "ttsdf_localization/atlas/place_index_file.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/progress.h"

namespace ttsdf {

void updatePlaceIndex(const std::string& folder, Progress& progress) {
  AtlasLocator locator(folder, readAtlas(folder));
  locator.completeIndex([&progress](double share) {
    progress.update("looking around in the maps", share);
    return true;
  });
  writePlaceIndex(locator.index(), folder);  // one damaged map takes nothing from the others
  for (const auto& [map, why] : locator.failed()) {
    if (!map.empty()) throw std::runtime_error("map '" + map + "': " + why);
  }
  std::printf("%zu places, %zu bytes\n", locator.index().placeCount(), locator.index().memoryBytes());
}

int runAtlasIndex(int argc, char** argv) {
  std::string folder;
  CommandLine line(
      "ttsdf_atlas index", "FOLDER",
      "Looks around in every map that has changed and writes places.bin, with which a robot finds "
      "the map it is in. Robots make what is missing themselves, at every start.");
  line.positional("FOLDER", folder);
  if (!line.parse(argc, argv, std::cout)) return 0;
  Progress progress("ttsdf_atlas");
  updatePlaceIndex(folder, progress);
  return 0;
}

}  // namespace ttsdf

// Trajectories, option files, lists of an atlas and of scans: the first byte chooses.

#include "files.h"
#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/evaluation/trajectory_error.h"
#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/tools/option_file.h"
#include "ttsdf_localization/tools/scan_io.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ttsdf::fuzz::Folder folder;
  if (size == 0) return 0;
  const std::string path = folder.write("atlas.yaml", data + 1, size - 1);
  try {
    switch (*data % 5) {
      case 0:
        ttsdf::readTrajectory(path);
        break;
      case 1:
        ttsdf::loadOptionFile(path);
        break;
      case 2:
        ttsdf::readAtlas(folder.path());
        break;
      case 3:
        ttsdf::readBatch(path);
        break;
      default:
        ttsdf::readPose(path);
    }
  } catch (const std::runtime_error&) {
  }
  return 0;
}

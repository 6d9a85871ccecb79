// Folders of depth frames: files of every layout, each as number of its name, length, bytes.

#include "ttsdf_localization/frames/frame_folder.h"

#include "files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ttsdf::fuzz;
  static const Folder folder;
  folder.clear();
  while (size >= 3) {
    const std::string& name = chosen(kFrameFiles, data[0]);
    const std::size_t length = std::min<std::size_t>(data[1] | std::size_t{data[2]} << 8, size - 3);
    folder.write(name, data + 3, length);
    data += 3 + length;
    size -= 3 + length;
  }
  try {
    const ttsdf::FrameFolder frames(folder.path(), ttsdf::FrameFolderOptions{});
    for (const ttsdf::FrameEntry& entry : frames.frames()) {
      frames.pose(entry);
      if (!frames.holdsClouds()) frames.depth(entry);
    }
  } catch (const std::runtime_error&) {
  }
  return 0;
}

// Scans as files: the first byte chooses the ending.

#include "ttsdf_localization/readers/cloud_file.h"

#include "files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ttsdf::fuzz;
  readAsFile(data, size, kCloudEndings, [](const std::string& path) { ttsdf::readScanFile(path); });
  return 0;
}

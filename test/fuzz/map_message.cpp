// Map files as they are, checksums and all: as they come in ttsdf_localization/TtSdfMap.

#include "ros/messages/conversions.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ttsdf_localization::TtSdfMap message;
  message.data.assign(data, data + size);
  try {
    ttsdf::fromMapMessage(message);
  } catch (const ttsdf::MapFormatError&) {
  }
  return 0;
}

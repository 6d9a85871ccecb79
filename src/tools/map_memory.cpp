#include "ttsdf_localization/tools/map_memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "ttsdf_localization/field/tt_distance_field.h"

namespace ttsdf {

namespace {

Json::Value bytesOf(std::size_t bytes) { return static_cast<Json::UInt64>(bytes); }

}  // namespace

Json::Value memoryByPart(const DistanceField& field, const DistanceField* far) {
  Json::Value parts(Json::objectValue);
  if (const auto* compressed = dynamic_cast<const TtDistanceField*>(&field)) {
    const FieldMemory memory = compressed->memory();
    parts["cores_bytes"] = bytesOf(memory.cores);
    parts["mask_bytes"] = bytesOf(memory.mask);
    parts["columns_bytes"] = bytesOf(memory.columns);
    parts["bricks_bytes"] = bytesOf(memory.bricks);
  } else {
    parts["field_bytes"] = bytesOf(field.memoryBytes());
  }
  const std::size_t of_far = far ? far->memoryBytes() : 0;
  parts["far_field_bytes"] = bytesOf(of_far);
  parts["map_memory_bytes"] = bytesOf(field.memoryBytes() + of_far);
  return parts;
}

ResidentMemory residentMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
  std::ifstream file("/proc/self/statm");
  std::size_t total = 0, resident = 0, of_files = 0;
  file >> total >> resident >> of_files;
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  return {resident * page, (resident - of_files) * page};
}

std::size_t peakResidentBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

}  // namespace ttsdf

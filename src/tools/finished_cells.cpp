#include "finished_cells.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace ttsdf {

namespace {
constexpr const char* kFile = "unfinished_build.txt";
constexpr const char* kEnd = "done";  // of a line: it is whole
}  // namespace

FinishedCells::FinishedCells(const std::string& folder)
    : folder_(folder), path_((std::filesystem::path(folder) / kFile).string()) {
  std::ifstream file(path_);
  for (std::string text; std::getline(file, text);) {
    std::istringstream words(text);
    std::string cell, end;
    Line line{};
    if (words >> cell >> line.key >> line.map_id >> end && end == kEnd) lines_[cell] = line;
  }
}

AtlasMap FinishedCells::find(const std::string& cell, std::uint64_t key) const {
  std::string map_id;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto line = lines_.find(cell);
    if (line == lines_.end() || line->second.key != key) return {};
    map_id = line->second.map_id;
  }
  AtlasMap map;
  map.file = cell + ".ttsdf";
  try {
    map = describeMap(cell, map.file, readFile(mapPath(folder_, map)));
  } catch (const std::exception&) {
    return {};  // it is made again
  }
  return map.map_id == map_id ? map : AtlasMap();
}

void FinishedCells::add(const std::string& cell, std::uint64_t key, const std::string& map_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::ofstream file(path_, std::ios::app);
  // The line before may have no end.
  file << '\n' << cell << ' ' << key << ' ' << map_id << ' ' << kEnd << std::flush;
  if (!file) throw std::runtime_error("'" + path_ + "': cannot write (is the disk full?)");
  lines_[cell] = {key, map_id};
}

void FinishedCells::remove() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

}  // namespace ttsdf

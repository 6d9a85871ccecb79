#pragma once
// Which cells of an atlas that is being built are done: a build that was stopped goes on where it was.

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

#include "ttsdf_localization/atlas/atlas.h"

namespace ttsdf {

/// Lines of a text file beside the maps: cell, key of what its map is made from, id of the map. Thread-safe.
class FinishedCells {
 public:
  /// Reads what an earlier build left in the folder; a line that was not written to its end is ignored.
  explicit FinishedCells(const std::string& folder);

  /// The map of a cell, if it was made from the same and its file is whole; `map.map_id` is empty otherwise.
  AtlasMap find(const std::string& cell, std::uint64_t key) const;
  /// To be called when the map's file is in its place. Throws std::runtime_error naming the file.
  void add(const std::string& cell, std::uint64_t key, const std::string& map_id);
  /// The atlas is complete.
  void remove();

 private:
  struct Line {
    std::uint64_t key;
    std::string map_id;
  };
  const std::string folder_, path_;
  mutable std::mutex mutex_;
  std::map<std::string, Line> lines_;
};

}  // namespace ttsdf

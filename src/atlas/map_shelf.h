#pragma once
// The maps in memory. Not thread-safe.

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/atlas/atlas_field.h"

namespace ttsdf {

class MapShelf {
 public:
  /// Bytes of everything on it, as the fields count them now.
  std::size_t bytes() const;
  std::size_t size() const { return maps_.size(); }
  /// On the shelf, in whatever edition.
  bool has(const std::string& name) const { return maps_.count(name) != 0; }
  bool hasEdition(const AtlasMap& map) const;
  /// Bytes of a map: as they are, or as they were when it was here last; `otherwise` if it never was.
  std::size_t expected(const AtlasMap& map, std::size_t otherwise) const;
  const PlacedField& get(const std::string& name) const { return maps_.at(name).placed; }

  void put(PlacedField map);
  void drop(const std::string& name) { maps_.erase(name); }
  /// It is wanted now.
  void touch(const std::string& name);
  /// Drops the least recently wanted maps but those in `keep` until there is room for `bytes` in `budget`.
  /// False: there is none.
  bool makeRoom(std::size_t bytes, std::size_t budget, const std::set<std::string>& keep);
  /// Poses as a new edition of the atlas has them; maps that it does not have go.
  void follow(const Atlas& atlas);

 private:
  struct Item {
    PlacedField placed;
    std::uint64_t wanted = 0;  ///< rises
  };
  static std::size_t bytesOf(const PlacedField& map);
  std::map<std::string, Item> maps_;
  std::map<std::string, std::size_t> measured_;  ///< id -> bytes when it was put here
  std::uint64_t clock_ = 0;
};

/// Gets a map and makes it ready. Throws std::runtime_error (also for another id than the atlas says),
/// Cancelled.
PlacedField loadPlaced(const MapBytes& files, const AtlasMap& map, double megabytes, bool long_range,
                       const MapLimits& limits, const KeepGoing& keep_going);

}  // namespace ttsdf

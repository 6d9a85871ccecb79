#pragma once
// The tasks of an atlas that is being built: files in a folder beside the maps, so that any process on any
// machine that sees the folder can make the map of one cell.
//
//   unfinished_build/settings.json   what all maps are made with, and the cells in their order
//   unfinished_build/CELL.vdb, .key  a task: the cell's part of the volume, and what tells it from another
//   unfinished_build/CELL.result     what came of it
//   CELL.ttsdf                       its map

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/field/frame_agreement.h"
#include "ttsdf_localization/fusion/tsdf_volume.h"
#include "ttsdf_localization/mapping/map_builder.h"

namespace ttsdf {

struct TaskSettings {
  FusionOptions fusion;
  BuildOptions build;
  FrameAgreement agreement;
  double min_surface = 0.0;        ///< cells with less get no map [m2]
  std::vector<std::string> cells;  ///< in the order of atlas.yaml

  /// Beside a cell's part, what its map depends on.
  std::string decisive() const;
};

class TaskFolder {
 public:
  /// Of the atlas folder; nothing is made or read yet.
  explicit TaskFolder(const std::string& atlas_folder);

  /// Makes the folder. All of these throw std::runtime_error naming the file.
  void writeSettings(const TaskSettings& settings) const;
  TaskSettings readSettings() const;

  /// Of a part with these settings (TaskSettings::decisive).
  static std::string keyOf(const TsdfVolume& part, const std::string& decisive);
  void writeTask(const std::string& cell, const std::string& key, const TsdfVolume& part) const;
  /// In place of a task: the part is empty, its cell gets no map.
  void writeNoMap(const std::string& cell, const std::string& key) const;
  /// Makes the map of a cell, or finds that it needs none: a function of the task's files alone. May be run
  /// again at any time, and returns at once where it was done.
  void run(const std::string& cell) const;
  /// The map of a cell that was made from this key and is still whole, with an empty id if the cell needs
  /// none; nothing: to be made.
  std::optional<AtlasMap> made(const std::string& cell, const std::string& key) const;
  /// Key of the task that was written last.
  std::string keyOf(const std::string& cell) const;
  /// The part is no longer needed.
  void dropPart(const std::string& cell) const;
  void remove() const;

  /// Where what a task prints goes.
  std::string logOf(const std::string& cell) const { return path(cell, ".log"); }
  std::string fileNamed(const std::string& name) const { return tasks_ + "/" + name; }

 private:
  std::string path(const std::string& cell, const char* ending) const { return tasks_ + "/" + cell + ending; }
  void writeResult(const std::string& cell, const std::string& key, const std::string& id) const;
  void writeText(const std::string& path, const std::string& text) const;
  const std::string folder_, tasks_;
};

}  // namespace ttsdf

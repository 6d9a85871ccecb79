// build, cell, finish: one source, many maps.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <optional>
#include <stdexcept>

#include "../source_flags.h"
#include "atlas_commands.h"
#include "atlas_mesh.h"
#include "atlas_tasks.h"
#include "atlas_workers.h"
#include "ttsdf_localization/fusion/volume_parts.h"
#include "ttsdf_localization/tools/build_sources.h"
#include "ttsdf_localization/tools/command_line.h"

namespace ttsdf {

namespace {

namespace fs = std::filesystem;

struct AtlasBuildArguments {
  std::string folder, scheduler, commands, worker;
  BuildArguments source;
  double size = 8.0, overlap = 1.0, min_surface = 1.0;
  int workers = 1;
};

void declareAtlasBuild(CommandLine& line, AtlasBuildArguments& a) {
  BuildArguments& s = a.source;
  line.positional("FOLDER", a.folder);
  declareSources(line, s);
  line.value("size", "METRES", a.size, "Largest side of what a map answers for.")
      .value("overlap", "METRES", a.overlap, "What neighbours share.")
      .value("min-surface", "M2", a.min_surface, "Cells with less surface get no map.")
      .value("workers", "N", a.workers,
             "Processes that make maps at the same time; the result does not depend on it.")
      .value("scheduler", "ADDRESS", a.scheduler,
             "Makes the maps through a Dask cluster whose workers see the folder under the same name, "
             "e.g. tcp://host:8786.")
      .value(
          "commands", "FILE", a.commands,
          "Makes no map but writes the commands that do, one a line, or as rules of make (Makefile, *.mk); "
          "afterwards: ttsdf_atlas finish FOLDER.")
      .value("worker", "COMMAND", a.worker,
             "Begins the command of every task, e.g. 'srun -c 2 ttsdf_atlas'; this program by default.")
      .options("fusion", fusionOptionTable(), s.fusion)
      .options("build", buildOptionTable(), s.build);
}

void checkAtlasBuild(const AtlasBuildArguments& a) {
  checkSources(a.source);
  if (!(a.size > 0.0)) throw UsageError("--size: wanted a number above 0");
  if (!(a.overlap >= 0.0) || !(a.overlap < a.size))
    throw UsageError("--overlap: wanted 0 to less than --size");
  if (!(a.min_surface >= 0.0)) throw UsageError("--min-surface: wanted 0 or more");
  if (a.workers < 1 || a.workers > 256) throw UsageError("--workers: wanted 1 to 256");
  if (!a.scheduler.empty() && !a.commands.empty())
    throw UsageError("got --scheduler and --commands, wanted one");
}

TsdfVolume readSource(const BuildArguments& a, Progress& progress, BuildSource& source) {
  return a.mesh.empty() ? volumeFromSource(a, progress, source) : volumeFromMesh(a, progress);
}

/// Commands may be run in another directory.
std::string absoluteFolder(const std::string& folder) {
  return fs::absolute(folder).lexically_normal().string();
}

std::string workerOf(const AtlasBuildArguments& a) {
  return a.worker.empty() ? shellWord(fs::read_symlink("/proc/self/exe").string()) : a.worker;
}

/// Cuts a volume into tasks and sees that each is done.
class CellBuilder {
 public:
  CellBuilder(const AtlasBuildArguments& arguments, const TsdfVolume& volume, TaskSettings settings,
              Progress& progress)
      : a_(arguments),
        volume_(volume),
        settings_(std::move(settings)),
        decisive_(settings_.decisive()),
        tasks_(arguments.folder),
        progress_(progress),
        cells_(cellsOf(surfaceBounds(volume), arguments.size, arguments.overlap)) {
    for (const VolumeCell& cell : cells_) settings_.cells.push_back(cell.name);
    tasks_.writeSettings(settings_);
  }

  /// Makes all maps that are not there yet.
  void run() {
    const TaskDone done = [this](const WorkerTask& task) {
      tasks_.dropPart(task.name);
      show();
    };
    if (a_.scheduler.empty()) {
      runInProcesses(
          a_.workers, [this] { return next(); }, done);
    } else {
      runThroughDask(a_.scheduler, all(), tasks_.fileNamed("tasks.json"), done);
    }
  }
  void write() {
    const std::vector<WorkerTask> tasks = all();
    writeCommands(tasks, workerOf(a_) + " finish " + shellWord(absoluteFolder(a_.folder)), a_.commands);
    std::printf("%zu commands in %s; when they are done: ttsdf_atlas finish %s\n", tasks.size(),
                a_.commands.c_str(), a_.folder.c_str());
  }
  /// Maps that a build before this one made.
  int taken() const { return taken_; }

 private:
  /// The next cell whose map is not there yet, its files written.
  std::optional<WorkerTask> next() {
    while (next_ < cells_.size()) {
      const VolumeCell& cell = cells_[next_++];
      const TsdfVolume part = partOf(volume_, cell.box);
      const std::string key = TaskFolder::keyOf(part, decisive_);
      const auto before = tasks_.made(cell.name, key);
      if (before && !before->map_id.empty()) ++taken_;
      if (before) {
        show();
        continue;
      }
      if (part.empty()) {
        tasks_.writeNoMap(cell.name, key);
        show();
        continue;
      }
      tasks_.writeTask(cell.name, key, part);
      return WorkerTask{cell.name,
                        workerOf(a_) + " cell " + shellWord(absoluteFolder(a_.folder)) + ' ' + cell.name,
                        tasks_.logOf(cell.name)};
    }
    return std::nullopt;
  }
  std::vector<WorkerTask> all() {
    std::vector<WorkerTask> tasks;
    while (auto task = next()) tasks.push_back(std::move(*task));
    return tasks;
  }
  void show() {
    progress_.update("building maps", static_cast<double>(++done_) / static_cast<double>(cells_.size()));
  }

  const AtlasBuildArguments& a_;
  const TsdfVolume& volume_;
  TaskSettings settings_;
  const std::string decisive_;
  const TaskFolder tasks_;
  Progress& progress_;
  const std::vector<VolumeCell> cells_;
  std::size_t next_ = 0, done_ = 0;
  int taken_ = 0;
};

void requireNoAtlas(const std::string& folder) {
  if (fs::exists(fs::path(folder) / kAtlasFile)) {
    throw std::runtime_error("'" + folder + "': got a folder with an atlas, wanted a new one");
  }
}

/// Writes the atlas of the maps that the tasks made, and its index.
void writeFinishedAtlas(const std::string& folder, int taken, Progress& progress) {
  requireNoAtlas(folder);
  const TaskFolder tasks(folder);
  const TaskSettings settings = tasks.readSettings();
  Atlas atlas;
  std::size_t bytes = 0, missing = 0;
  std::string names;
  for (const std::string& cell : settings.cells) {
    const auto map = tasks.made(cell, tasks.keyOf(cell));
    if (!map) {
      if (missing++ < 5) names += (names.empty() ? "" : ", ") + cell;
    } else if (!map->map_id.empty()) {
      atlas.maps.push_back(*map);
      bytes += map->bytes;
    }
  }
  if (missing > 0) {
    throw std::runtime_error("'" + folder + "': got no result of " + std::to_string(missing) + " of " +
                             std::to_string(settings.cells.size()) + " cells (" + names +
                             "), wanted them all (run their commands, or build again)");
  }
  if (atlas.maps.empty()) {
    throw std::runtime_error("got no cell with " + std::to_string(settings.min_surface) +
                             " m2 of surface (--min-surface)");
  }
  writeAtlas(atlas, folder);
  tasks.remove();
  std::printf("%zu maps, %zu bytes\n", atlas.maps.size(), bytes);
  if (taken > 0) std::printf("%d of them made by a build before this one\n", taken);
  updatePlaceIndex(folder, progress);
}

}  // namespace

int runAtlasBuild(int argc, char** argv) {
  AtlasBuildArguments a;
  CommandLine line(
      "ttsdf_atlas build",
      "FOLDER (--frames DIR | --mesh FILE | --cloud FILE | --vdb FILE | --octomap FILE) [options]",
      "Cuts a source into cells that overlap and builds a map of each.");
  declareAtlasBuild(line, a);
  if (!line.parse(argc, argv, std::cout)) return 0;
  checkAtlasBuild(a);
  fs::create_directories(a.folder);
  requireNoAtlas(a.folder);
  requireWritable((fs::path(a.folder) / kAtlasFile).string());  // before the work, not after it
  if (!a.commands.empty()) requireWritable(a.commands);
  Progress progress("ttsdf_atlas");
  BuildSource source;
  const TsdfVolume volume = readSource(a.source, progress, source);
  if (volume.empty()) throw std::runtime_error("got no surface, wanted frames that show one");
  CellBuilder builder(a, volume, {volume.options(), a.source.build, source.agreement, a.min_surface, {}},
                      progress);
  if (!a.commands.empty()) {
    builder.write();
    return 0;
  }
  builder.run();
  writeFinishedAtlas(a.folder, builder.taken(), progress);
  return 0;
}

int runAtlasCell(int argc, char** argv) {
  std::string folder, cell;
  CommandLine line("ttsdf_atlas cell", "FOLDER CELL",
                   "Makes the map of one cell of a build that was begun: what its workers run.");
  line.positional("FOLDER", folder).positional("CELL", cell);
  if (!line.parse(argc, argv, std::cout)) return 0;
  TaskFolder(folder).run(cell);
  return 0;
}

int runAtlasFinish(int argc, char** argv) {
  std::string folder;
  CommandLine line("ttsdf_atlas finish", "FOLDER",
                   "Writes atlas.yaml and the index when the commands of build --commands were run.");
  line.positional("FOLDER", folder);
  if (!line.parse(argc, argv, std::cout)) return 0;
  Progress progress("ttsdf_atlas");
  writeFinishedAtlas(folder, 0, progress);
  return 0;
}

}  // namespace ttsdf

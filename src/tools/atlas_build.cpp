// build: one source, many maps.

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "atlas_commands.h"
#include "finished_cells.h"
#include "ttsdf_localization/fusion/volume_parts.h"
#include "ttsdf_localization/surface/surface_mesh.h"
#include "ttsdf_localization/tools/build_sources.h"
#include "ttsdf_localization/tools/command_line.h"

namespace ttsdf {

namespace {

namespace fs = std::filesystem;
constexpr int kBuildForm = 1;  // rises when maps of the same cell come out differently

struct AtlasBuildArguments {
  std::string folder;
  BuildArguments source;
  double size = 8.0, overlap = 1.0, min_surface = 1.0;
  int workers = 1;
};

void declareAtlasBuild(CommandLine& line, AtlasBuildArguments& a) {
  BuildArguments& s = a.source;
  line.positional("FOLDER", a.folder)
      .value("frames", "DIR", s.frames, "Folder of depth frames with poses, as ttsdf_build takes it.")
      .value("vdb", "FILE", s.vdb, "Level set or truncated signed distance grid (OpenVDB).")
      .value("cloud", "FILE", s.cloud, "Points of surfaces: .pcd, .ply, .xyz, .csv or .bin.")
      .value("octomap", "FILE", s.octomap, "Octree of octomap: .bt or .ot.")
      .value("size", "METRES", a.size, "Largest side of what a map answers for.")
      .value("overlap", "METRES", a.overlap, "What neighbours share.")
      .value("min-surface", "M2", a.min_surface, "Cells with less surface get no map.")
      .value("workers", "N", a.workers, "Maps made at the same time; the result does not depend on it.")
      .value("every", "N", s.every, "Takes the frames whose index % N is the offset.")
      .value("offset", "M", s.offset, "See --every.")
      .value("scale", "S", s.scale, "Metres per unit of the cloud, .vdb file or octree.")
      .flag("trust-frames", s.trust_frames, "Builds even if the frames contradict one another.")
      .options("fusion", fusionOptionTable(), s.fusion)
      .options("build", buildOptionTable(), s.build);
}

void checkAtlasBuild(const AtlasBuildArguments& a) {
  const BuildArguments& s = a.source;
  const int sources = !s.frames.empty() + !s.vdb.empty() + !s.cloud.empty() + !s.octomap.empty();
  if (sources != 1) {
    throw UsageError("got " + std::to_string(sources) +
                     " sources, wanted one of --frames, --cloud, --vdb, --octomap");
  }
  if (s.every < 1 || s.offset < 0 || s.offset >= s.every) throw UsageError("wanted 0 <= --offset < --every");
  if (!(a.size > 0.0)) throw UsageError("--size: wanted a number above 0");
  if (!(a.overlap >= 0.0) || !(a.overlap < a.size))
    throw UsageError("--overlap: wanted 0 to less than --size");
  if (!(a.min_surface >= 0.0)) throw UsageError("--min-surface: wanted 0 or more");
  if (a.workers < 1 || a.workers > 256) throw UsageError("--workers: wanted 1 to 256");
  if (!(s.scale > 0.0)) throw UsageError("--scale: wanted a number above 0");
  try {
    validate(s.build);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

/// Area of the observed surface [m2].
double areaOf(const SurfaceMesh& mesh) {
  double area = 0.0;
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    const Eigen::Vector3f a = mesh.vertices.col(mesh.triangles(0, n)),
                          b = mesh.vertices.col(mesh.triangles(1, n)),
                          c = mesh.vertices.col(mesh.triangles(2, n));
    area += 0.5 * static_cast<double>((b - a).cross(c - a).norm());
  }
  return area;
}

std::uint64_t sumOf(std::uint64_t sum, const std::string& text) {
  for (const char byte : text) sum = (sum ^ static_cast<unsigned char>(byte)) * 1099511628211ULL;
  return sum;
}

/// What all maps are made with, beside their cells.
std::string settingsOf(const AtlasBuildArguments& a, const FrameAgreement& agreement) {
  std::ostringstream text;
  text.precision(17);
  text << kBuildForm << ' ' << a.min_surface;
  for (const auto& row : buildOptionTable().rows()) {
    if (row.name != "threads") text << ' ' << row.name << '=' << toString(row.get(a.source.build));
  }
  for (const double figure :
       {agreement.position_median, agreement.position_90, agreement.rotation_median, agreement.rotation_90,
        agreement.widening, agreement.shift, agreement.turn_sensor, agreement.turn_scene})
    text << ' ' << figure;
  text << ' ' << agreement.compared << ' ' << agreement.contradicting << ' ' << agreement.without_overlap;
  return text.str();
}

/// Makes the maps of all cells with several threads. A map is a function of its cell alone, so one that a
/// build before has made of the same cell is taken as it is.
class CellBuilder {
 public:
  CellBuilder(const AtlasBuildArguments& arguments, const TsdfVolume& volume, const FrameAgreement& agreement,
              std::vector<VolumeCell> cells, Progress& progress)
      : a_(arguments),
        volume_(volume),
        agreement_(agreement),
        settings_(settingsOf(arguments, agreement)),
        finished_(arguments.folder),
        cells_(std::move(cells)),
        made_(cells_.size()),
        progress_(progress) {}

  std::vector<AtlasMap> run() {
    std::vector<std::thread> threads;
    for (int n = 0; n < a_.workers; ++n) threads.emplace_back([this] { work(); });
    for (std::thread& thread : threads) thread.join();
    if (error_) std::rethrow_exception(error_);
    std::vector<AtlasMap> maps;
    for (const auto& map : made_) {
      if (map) maps.push_back(*map);
    }
    return maps;
  }
  /// Maps that were there already.
  int taken() const { return taken_; }
  /// The atlas is written: nothing is left to go on with.
  void forgetFinished() { finished_.remove(); }

 private:
  void work() {
    for (std::size_t n = next_++; n < cells_.size(); n = next_++) {
      try {
        build(n);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (!error_) error_ = std::current_exception();
        next_ = cells_.size();
      }
      const std::lock_guard<std::mutex> lock(mutex_);
      progress_.update("building maps", static_cast<double>(++done_) / static_cast<double>(cells_.size()));
    }
  }

  void build(std::size_t n) {
    const VolumeCell& cell = cells_[n];
    const TsdfVolume part = partOf(volume_, cell.box);
    if (part.empty()) return;
    const std::uint64_t key = sumOf(contentSum(part), settings_);
    AtlasMap before = finished_.find(cell.name, key);
    if (!before.map_id.empty()) {
      made_[n] = std::move(before);
      ++taken_;
      return;
    }
    if (areaOf(extractSurface(part)) < a_.min_surface) return;
    const BuiltMap built = buildMap(part, a_.source.build, {}, agreement_);
    AtlasMap entry = describeMap(cell.name, cell.name + ".ttsdf", built.bytes);
    writeFileAtomically(mapPath(a_.folder, entry), built.bytes, kMapFile);
    finished_.add(cell.name, key, entry.map_id);
    made_[n] = std::move(entry);
  }

  const AtlasBuildArguments& a_;
  const TsdfVolume& volume_;
  const FrameAgreement& agreement_;
  const std::string settings_;
  FinishedCells finished_;
  const std::vector<VolumeCell> cells_;
  std::vector<std::optional<AtlasMap>> made_;
  Progress& progress_;
  std::atomic<std::size_t> next_{0};
  std::mutex mutex_;
  std::size_t done_ = 0;
  std::atomic<int> taken_{0};
  std::exception_ptr error_;
};

}  // namespace

int runAtlasBuild(int argc, char** argv) {
  AtlasBuildArguments a;
  CommandLine line("ttsdf_atlas build",
                   "FOLDER (--frames DIR | --cloud FILE | --vdb FILE | --octomap FILE) [options]",
                   "Cuts a source into cells that overlap and builds a map of each.");
  declareAtlasBuild(line, a);
  if (!line.parse(argc, argv, std::cout)) return 0;
  checkAtlasBuild(a);
  fs::create_directories(a.folder);
  if (fs::exists(fs::path(a.folder) / kAtlasFile)) {
    throw std::runtime_error("'" + a.folder + "': got a folder with an atlas, wanted a new one");
  }
  requireWritable((fs::path(a.folder) / kAtlasFile).string());  // before the work, not after it
  Progress progress("ttsdf_atlas");
  BuildSource source;
  const TsdfVolume volume = volumeFromSource(a.source, progress, source);
  if (volume.empty()) throw std::runtime_error("got no surface, wanted frames that show one");
  CellBuilder builder(a, volume, source.agreement, cellsOf(surfaceBounds(volume), a.size, a.overlap),
                      progress);
  Atlas atlas;
  atlas.maps = builder.run();
  std::size_t bytes = 0;
  for (const AtlasMap& map : atlas.maps) bytes += map.bytes;
  if (atlas.maps.empty()) {
    throw std::runtime_error("got no cell with " + std::to_string(a.min_surface) +
                             " m2 of surface (--min-surface)");
  }
  writeAtlas(atlas, a.folder);
  builder.forgetFinished();
  std::printf("%zu maps, %zu bytes\n", atlas.maps.size(), bytes);
  if (builder.taken() > 0) std::printf("%d of them made by a build before this one\n", builder.taken());
  updatePlaceIndex(a.folder, progress);
  return 0;
}

}  // namespace ttsdf

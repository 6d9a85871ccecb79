// A drive through an atlas against one map of the whole, and what the number of maps costs.
//
// usage: atlas_drive drive ATLAS_FOLDER WHOLE_MAP.ttsdf FRAMES_FOLDER [MEGABYTES]
//        atlas_drive which ATLAS_FOLDER FRAMES_FOLDER [EVERY OFFSET]   (a line for each scan:
//        ATLAS_DRIVE_SCANS=1) atlas_drive count ATLAS_FOLDER

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>

#include "ttsdf_localization/atlas/atlas_loader.h"
#include "ttsdf_localization/atlas/atlas_search.h"
#include "ttsdf_localization/field/long_range_field.h"
#include "ttsdf_localization/frames/depth_image.h"
#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/registration/registration.h"

namespace {

using namespace ttsdf;  // NOLINT(google-build-using-namespace): a program of one file
using Clock = std::chrono::steady_clock;

/// Processor time of this thread [s], and how often it had to wait for something.
struct ThreadUse {
  double seconds = 0.0;
  long waits = 0;
};
ThreadUse threadUse() {
  rusage use{};
  getrusage(RUSAGE_THREAD, &use);
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return {static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec), use.ru_nvcsw};
}

double since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

/// Resident memory [MB].
double resident() {
  std::ifstream file("/proc/self/statm");
  double total = 0.0, pages = 0.0;
  file >> total >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

ScanPoints pointsOf(const DepthImage& image, const CameraIntrinsics& intrinsics) {
  constexpr int kEvery = 4;
  return toPoints(image, intrinsics, kEvery, 0.2, 10.0);
}

struct Figures {
  std::vector<double> errors, milliseconds;
  int used = 0, scans = 0;
  void add(const RegistrationResult& result, const Eigen::Isometry3d& truth, double ms) {
    ++scans;
    milliseconds.push_back(ms);
    if (!result.success) return;
    ++used;
    errors.push_back(poseError(truth, result.T_map_sensor).translation);
  }
  void print(const char* what) {
    double sum = 0.0;
    for (const double e : errors) sum += e * e;
    std::sort(errors.begin(), errors.end());
    std::sort(milliseconds.begin(), milliseconds.end());
    std::printf("%s: %d of %d scans verified, rmse %.1f mm, 99 %% below %.1f mm, median %.1f ms a scan\n",
                what, used, scans, 1e3 * std::sqrt(sum / std::max<std::size_t>(1, errors.size())),
                1e3 * errors[errors.size() * 99 / 100], milliseconds[milliseconds.size() / 2]);
  }
};

void drive(const std::string& folder, const std::string& whole, const std::string& frames_folder,
           double megabytes) {
  const FrameFolder frames(frames_folder);
  const auto map = std::shared_ptr<const DistanceField>(makeField(loadMap(whole)));
  Registration in_one(map);
  AtlasLoaderOptions options;
  options.memory_megabytes = megabytes;
  options.radius = 3.0;
  AtlasLoader loader(folder, readAtlas(folder), options);
  std::shared_ptr<const AtlasField> field;
  std::unique_ptr<Registration> in_atlas;
  Figures one, many;
  std::vector<double> between;
  double longest_want = 0.0, longest_work = 0.0, most_memory = 0.0;
  long waits = 0;
  int exchanges = 0, behind = 0;
  std::size_t most_bytes = 0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  const auto list = frames.select(1, 0);
  for (std::size_t n = 0; n < list.size(); ++n) {
    const Eigen::Isometry3d truth = frames.pose(list[n]);
    const ScanPoints scan = pointsOf(frames.depth(list[n]), frames.intrinsics());
    const Eigen::Vector3d velocity = n == 0 ? Eigen::Vector3d::Zero() : (truth.translation() - before).eval();
    before = truth.translation();
    const ThreadUse before_want = threadUse();
    auto begin = Clock::now();
    loader.want(truth.translation(), velocity);  // a frame a second
    longest_want = std::max(longest_want, since(begin));
    const ThreadUse after = threadUse();
    longest_work = std::max(longest_work, after.seconds - before_want.seconds);
    waits += after.waits - before_want.waits;
    if (n == 0) loader.waitUntilSettled(60.0);
    if (loader.field() != field) {
      field = loader.field();
      in_atlas = std::make_unique<Registration>(field, RegistrationOptions(), field->farField());
      ++exchanges;
    }
    behind += loader.status().behind ? 1 : 0;
    most_bytes = std::max(most_bytes, loader.status().bytes);
    Eigen::Isometry3d prior = truth;
    const double phase = 2.4 * static_cast<double>(n);
    prior.translation() +=
        0.03 * Eigen::Vector3d(std::cos(phase), std::sin(phase), 0.3 * std::sin(3.0 * phase));
    prior.linear() = prior.linear() * expSo3(0.02 * Eigen::Vector3d(std::sin(phase), std::cos(phase), 0.0));
    begin = Clock::now();
    const RegistrationResult a = in_atlas->align(scan, prior);
    many.add(a, truth, 1e3 * since(begin));
    begin = Clock::now();
    const RegistrationResult b = in_one.align(scan, prior);
    one.add(b, truth, 1e3 * since(begin));
    if (a.success && b.success) between.push_back(poseError(a.T_map_sensor, b.T_map_sensor).translation);
    most_memory = std::max(most_memory, resident());
  }
  one.print("one map");
  many.print("atlas");
  std::sort(between.begin(), between.end());
  std::printf("between the two: median %.2f mm\n", 1e3 * between[between.size() / 2]);
  std::printf(
      "%d fields, longest want() %.3f ms, of that %.3f ms its own work at the most, waits %ld, behind in %d "
      "scans, maps in memory at most %.1f MB, process %.1f "
      "MB\n",
      exchanges, 1e3 * longest_want, 1e3 * longest_work, waits, behind,
      static_cast<double>(most_bytes) / 1048576.0, most_memory);
}

/// Maps in memory, each with those that overlap with it.
class MapsInMemory {
 public:
  explicit MapsInMemory(const std::string& folder)
      : atlas_(readAtlas(folder)), neighbours_(atlas_.neighbours()) {
    for (const AtlasMap& entry : atlas_.maps) {
      PlacedField map;
      map.name = entry.name;
      map.T_atlas_map = entry.T_atlas_map;
      map.field = makeField(loadMap(mapPath(folder, entry)));
      map.far = makeLongRangeField(*map.field);
      map.field->warmUp();
      maps_.push_back(std::move(map));
    }
  }
  const Atlas& atlas() const { return atlas_; }
  std::vector<PlacedField> around(const std::string& name) const {
    std::vector<PlacedField> result;
    for (std::size_t n = 0; n < maps_.size(); ++n) {
      if (maps_[n].name != name) continue;
      result.push_back(maps_[n]);
      for (const std::size_t m : neighbours_[n]) result.push_back(maps_[m]);
    }
    return result;
  }

 private:
  Atlas atlas_;
  std::vector<std::vector<std::size_t>> neighbours_;
  std::vector<PlacedField> maps_;
};

/// Scans without a prior: which map, and where.
void whichMap(const std::string& folder, const std::string& frames_folder, int every, int offset) {
  constexpr double kRight = 0.05;  // [m]
  const FrameFolder frames(frames_folder);
  const MapsInMemory maps(folder);
  const Atlas& atlas = maps.atlas();
  PlaceIndex index;
  auto begin = Clock::now();
  for (const AtlasMap& entry : atlas.maps) index.add(maps.around(entry.name));
  std::printf("index: %zu places, %zu bytes, made in %.1f s\n", index.placeCount(), index.memoryBytes(),
              since(begin));
  std::map<std::string, int> outcomes;
  std::vector<double> seconds;
  int right = 0, wrong = 0, first = 0, scans = 0, excluded = 0, left = 0;
  const AtlasSearchOptions options;
  for (const FrameEntry& frame : frames.select(every, offset)) {
    const Eigen::Isometry3d truth = frames.pose(frame);
    const ScanPoints scan = pointsOf(frames.depth(frame), frames.intrinsics());
    const Eigen::Vector3d down = truth.linear().transpose() * -Eigen::Vector3d::UnitZ();
    ++scans;
    const auto ranked = index.rank(scan, down);
    double best_holding = 1.0;
    for (const auto& one : ranked) {
      left += one.difference < options.excluded_difference ? 1 : 0;
      if (atlas.find(one.map)->box().depth(truth.translation()) > 0.0)
        best_holding = std::min(best_holding, one.difference);
    }
    first += best_holding == ranked.front().difference ? 1 : 0;
    excluded += best_holding >= options.excluded_difference ? 1 : 0;
    begin = Clock::now();
    const AtlasLocation found = locateInAtlas(
        index, [&](const std::string& name) { return maps.around(name); }, scan, down, options);
    seconds.push_back(since(begin));
    const double error = found.candidates.empty()
                             ? INFINITY
                             : poseError(truth, found.candidates.front().T_atlas_sensor).translation;
    if (std::getenv("ATLAS_DRIVE_SCANS")) {
      std::printf(
          "%s %s: score %.3f, next %.3f, confidence %.2f, %.3f m off; index: best %.2f, of the right map "
          "%.2f\n",
          std::to_string(frame.index).c_str(), name(found.reason),
          found.candidates.empty() ? 1.0 : found.candidates[0].score(),
          found.candidates.size() > 1 ? found.candidates[1].score() : 1.0,
          found.candidates.empty() ? 0.0 : found.candidates[0].result.confidence, error,
          ranked.front().difference, best_holding);
    }
    if (!found.success) {
      ++outcomes[name(found.reason)];
      continue;
    }
    (error < kRight ? right : wrong) += 1;
    if (error >= kRight) {
      std::printf("wrong by %.2f m: score %.3f, the next place %.3f\n", error, found.candidates[0].score(),
                  found.candidates.size() > 1 ? found.candidates[1].score() : 1.0);
    }
  }
  std::sort(seconds.begin(), seconds.end());
  std::printf("which map: %d scans, %d within 5 cm, %d accepted further off", scans, right, wrong);
  for (const auto& [reason, count] : outcomes) std::printf(", %d %s", count, reason.c_str());
  std::printf("; %.2f s a scan (median), %.2f s at the most\n", seconds[seconds.size() / 2], seconds.back());
  std::printf(
      "the index's first map holds the camera in %d, excludes the right one in %d, leaves %.1f maps\n", first,
      excluded, static_cast<double>(left) / scans);
  std::fflush(stdout);
}

/// Copies of the first map on a square, each 7 m from the next.
void countMaps(const std::string& folder) {
  const Atlas source = readAtlas(folder);
  const std::string home = std::filesystem::temp_directory_path() / "atlas_drive";
  for (const int count : {1, 10, 100, 1000, 10000}) {
    std::filesystem::remove_all(home);
    std::filesystem::create_directories(home);
    Atlas atlas;
    const int side = static_cast<int>(std::ceil(std::sqrt(count)));
    for (int n = 0; n < count; ++n) {
      AtlasMap map = source.maps.front();
      map.name = "m" + std::to_string(n);
      map.file = map.name + ".ttsdf";
      map.T_atlas_map.translation() += 7.0 * Eigen::Vector3d(n % side, n / side, 0.0);
      atlas.maps.push_back(map);
    }
    // Only those that are driven through need files.
    for (int n = 0; n < std::min(count, 12); ++n) {
      std::filesystem::copy_file(mapPath(folder, source.maps.front()),
                                 home + "/m" + std::to_string(n) + ".ttsdf");
    }
    writeAtlas(atlas, home);
    auto begin = Clock::now();
    const Atlas read = readAtlas(home);
    const double reading = since(begin);
    begin = Clock::now();
    AtlasLoaderOptions options;
    options.radius = 1.0;
    AtlasLoader loader(home, read, options);
    const double starting = since(begin);
    const Eigen::Vector3d middle = read.maps.front().box().centre();
    loader.want(middle);
    loader.waitUntilSettled(60.0);
    const double first = since(begin) - starting;
    begin = Clock::now();
    constexpr int kLooks = 200;
    for (int n = 0; n < kLooks; ++n) {
      loader.want(middle + Eigen::Vector3d(0.0005 * n, 0.0, 0.0));
      loader.waitUntilSettled(60.0);
    }
    std::printf(
        "%5d maps: atlas.yaml %.0f ms, start %.2f ms, first maps %.0f ms, look-up %.3f ms, process %.1f MB\n",
        count, 1e3 * reading, 1e3 * starting, 1e3 * first, 1e3 * since(begin) / kLooks, resident());
    std::fflush(stdout);
  }
  std::filesystem::remove_all(home);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const auto number = [&](int n, double otherwise) { return argc > n ? std::atof(argv[n]) : otherwise; };
  if (what == "drive" && argc > 4) {
    drive(argv[2], argv[3], argv[4], number(5, 8.0));
  } else if (what == "which" && argc > 3) {
    whichMap(argv[2], argv[3], static_cast<int>(number(4, 7)), static_cast<int>(number(5, 3)));
  } else if (what == "count" && argc > 2) {
    countMaps(argv[2]);
  } else {
    std::fprintf(stderr,
                 "usage: atlas_drive drive ATLAS_FOLDER WHOLE_MAP.ttsdf FRAMES_FOLDER [MEGABYTES]\n"
                 "       atlas_drive which ATLAS_FOLDER FRAMES_FOLDER [EVERY OFFSET]\n"
                 "       atlas_drive count ATLAS_FOLDER\n");
    return 2;
  }
  return 0;
}

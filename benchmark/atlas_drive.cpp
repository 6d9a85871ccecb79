// A drive through an atlas against one map of the whole, and what the number of maps costs.
//
// usage: atlas_drive drive ATLAS_FOLDER WHOLE_MAP.ttsdf FRAMES_FOLDER [MEGABYTES]
//        atlas_drive which ATLAS_FOLDER FRAMES_FOLDER [EVERY OFFSET]   (a line for each scan:
//        ATLAS_DRIVE_SCANS=1) atlas_drive count ATLAS_FOLDER

#include <sys/resource.h>
#include <sys/wait.h>
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
#include <stdexcept>
#include <utility>

#include "ttsdf_localization/atlas/atlas_loader.h"
#include "ttsdf_localization/atlas/atlas_search.h"
#include "ttsdf_localization/atlas/place_index.h"
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

/// What a sensor at a place of a map would see in all directions, from the map itself.
ScanPoints seenIn(const DistanceField& field, const Eigen::Vector3d& from) {
  constexpr int kRays = 4000;
  constexpr double kLongest = 6.0, kGolden = 2.399963;  // [m], [rad]
  std::vector<Eigen::Vector3f> hits;
  for (int n = 0; n < kRays; ++n) {
    const double z = 1.0 - (2.0 * n + 1.0) / kRays, r = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d ray(r * std::cos(kGolden * n), r * std::sin(kGolden * n), z);
    double range = 0.2, step = 1.0;
    while (range < kLongest && step > 1e-3) {
      const Eigen::Matrix3Xf p = (from + range * ray - field.geometry().origin).cast<float>();
      const FieldSamples sample = field.evaluate(p);
      if (sample.states[0] != PointState::kValid) break;
      step = 0.8 * static_cast<double>(sample.values[0]);
      range += std::max(step, 1e-3);
    }
    if (step <= 1e-3) hits.push_back((range * ray).cast<float>());
  }
  ScanPoints points(3, static_cast<Eigen::Index>(hits.size()));
  for (std::size_t n = 0; n < hits.size(); ++n) points.col(static_cast<Eigen::Index>(n)) = hits[n];
  return points;
}

/// The place of an index from which most is seen.
std::pair<Eigen::Vector3d, ScanPoints> viewpointIn(const AtlasMap& map, const DistanceField& field) {
  PlaceIndex index;
  PlacedField placed;
  placed.name = map.name;
  placed.field = std::shared_ptr<const DistanceField>(&field, [](const DistanceField*) {});
  placed.far = makeLongRangeField(field);
  index.add({placed});
  std::pair<Eigen::Vector3d, ScanPoints> best;
  for (const IndexedPlace& place : index.maps().front().places) {
    const Eigen::Vector3d at = map.T_map_box * place.inBox();
    ScanPoints points = seenIn(field, at);
    if (points.cols() > best.second.cols()) best = {at, std::move(points)};
  }
  return best;
}

/// A folder with copies of a map on a square, a metre apart. The files are one file.
void writeCopies(const Atlas& source, const std::string& folder, int count, const std::string& home) {
  std::filesystem::remove_all(home);
  std::filesystem::create_directories(home);
  const AtlasMap& original = source.maps.front();
  std::filesystem::copy_file(mapPath(folder, original), home + "/m0.ttsdf");
  Atlas atlas;
  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  const Eigen::Vector3d pitch = original.box().bounds().sizes() + Eigen::Vector3d::Ones();
  for (int n = 0; n < count; ++n) {
    AtlasMap map = original;
    map.name = "m" + std::to_string(n);
    map.file = map.name + ".ttsdf";
    map.T_atlas_map.translation() += Eigen::Vector3d(n % side, n / side, 0.0).cwiseProduct(pitch);
    if (n > 0) std::filesystem::create_hard_link(home + "/m0.ttsdf", home + "/" + map.file);
    atlas.maps.push_back(map);
  }
  writeAtlas(atlas, home);
}

/// What an atlas of copies costs a robot in the middle of it.
void costOf(const std::string& home, const Eigen::Vector3d& viewpoint, const ScanPoints& scan) {
  const double before = resident();
  auto begin = Clock::now();
  double busy = threadUse().seconds;
  const Atlas read = readAtlas(home);
  const double reading = threadUse().seconds - busy;
  busy = threadUse().seconds;
  AtlasLoader loader(home, read, AtlasLoaderOptions());
  const double starting = threadUse().seconds - busy;
  const std::size_t count = read.maps.size(), side = static_cast<std::size_t>(std::ceil(std::sqrt(count)));
  const AtlasMap& middle = read.maps[std::min(count - 1, side / 2 * side + side / 2)];
  const Eigen::Vector3d place = middle.T_atlas_map * viewpoint;
  begin = Clock::now();
  loader.want(place);
  loader.waitUntilSettled(120.0);
  const double first = since(begin);
  constexpr int kLooks = 40, kLooksAtOnce = 25, kScans = 60;
  rusage use{};
  const auto processSeconds = [&use] {
    getrusage(RUSAGE_SELF, &use);
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return seconds(use.ru_utime) + seconds(use.ru_stime);
  };
  std::vector<double> looks;  // of some of them the loader may load a map
  for (int n = 0; n < kLooks; ++n) {
    const double looking = processSeconds();
    for (int k = 0; k < kLooksAtOnce; ++k) {
      loader.want(place + Eigen::Vector3d(2e-5 * (kLooksAtOnce * n + k), 0.0, 0.0));
      loader.waitUntilSettled(60.0);
    }
    looks.push_back((processSeconds() - looking) / kLooksAtOnce);
  }
  std::sort(looks.begin(), looks.end());
  const double look = looks[looks.size() / 2];
  const auto field = loader.field();
  Registration registration(field, RegistrationOptions(), field->farField());
  std::vector<double> scans;
  int right = 0;
  for (int n = 0; n < kScans; ++n) {
    Eigen::Isometry3d truth = Eigen::Isometry3d(middle.T_atlas_map.linear());
    truth.translation() = place;
    Eigen::Isometry3d prior = truth;
    prior.translation() +=
        0.03 * Eigen::Vector3d(std::cos(2.4 * n), std::sin(2.4 * n), 0.3 * std::sin(7.2 * n));
    busy = threadUse().seconds;
    const RegistrationResult result = registration.align(scan, prior);
    scans.push_back(threadUse().seconds - busy);
    right += result.success && poseError(truth, result.T_map_sensor).translation < 0.01 ? 1 : 0;
  }
  std::sort(scans.begin(), scans.end());
  std::printf(
      "%5zu maps: atlas.yaml %.2f ms, start %.2f ms, first maps %.0f ms, look-up %.3f ms, scan %.2f ms (%d "
      "of %d "
      "right), %zu maps in use, %.1f MB\n",
      count, 1e3 * reading, 1e3 * starting, 1e3 * first, 1e3 * look, 1e3 * scans[scans.size() / 2], right,
      kScans, loader.status().in_use.size(), resident() - before);
  std::fflush(stdout);
}

/// Copies of the first map; each number of them in a process of its own.
void countMaps(const std::string& folder) {
  const Atlas source = readAtlas(folder);
  const std::string home =
      std::filesystem::temp_directory_path() / ("atlas_drive_" + std::to_string(getpid()));
  const AtlasMap& original = source.maps.front();
  const auto [viewpoint, scan] = viewpointIn(original, *makeField(loadMap(mapPath(folder, original))));
  for (const int count : {1, 3, 10, 30, 100, 300, 1000, 3000, 10000}) {
    writeCopies(source, folder, count, home);
    const pid_t child = fork();
    if (child == 0) {
      costOf(home, viewpoint, scan);
      _exit(0);
    }
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child || status != 0)
      throw std::runtime_error("got no figures of " + std::to_string(count) + " maps");
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

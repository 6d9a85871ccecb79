// A hotel of many rooms on several storeys as an atlas: its volume, a drive through all of it, and which map
// a scan without a prior was taken in. scripts/atlas_scale runs all of it.
//
// usage: atlas_hotel volume FILE.vdb STOREYS ROOMS_PER_SIDE VOXEL
//        atlas_hotel drive ATLAS STOREYS ROOMS_PER_SIDE [SCANS_PER_SECOND MEGABYTES ROOMS]
//        atlas_hotel room ATLAS STOREYS ROOMS_PER_SIDE [SCANS_PER_SECOND ROOMS]
//        atlas_hotel which ATLAS STOREYS ROOMS_PER_SIDE [SCANS FIELD_OF_VIEW MAX_MAPS]
//        atlas_hotel moving ATLAS STOREYS ROOMS_PER_SIDE [STARTS FIELD_OF_VIEW METRES MEGABYTES]

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "ttsdf_localization/atlas/atlas_loader.h"
#include "ttsdf_localization/atlas/atlas_locator.h"
#include "ttsdf_localization/localization/localizer.h"
#include "ttsdf_localization/signed_field/ideal_volume.h"
#include "ttsdf_localization/simulation/depth_camera.h"
#include "ttsdf_localization/simulation/drifting_odometry.h"
#include "ttsdf_localization/simulation/hotel.h"
#include "ttsdf_localization/simulation/scene_sampling.h"
#include "ttsdf_localization/simulation/simulated_rig.h"

namespace {

using namespace ttsdf;  // NOLINT(google-build-using-namespace): a program of one file
using Clock = std::chrono::steady_clock;

double since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

double threadSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Resident memory [MB].
double resident() {
  std::ifstream file("/proc/self/statm");
  double total = 0.0, pages = 0.0;
  file >> total >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return NAN;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

Hotel hotelOf(int storeys, int rooms_per_side) {
  HotelOptions options;
  options.storeys = storeys, options.rooms_per_side = rooms_per_side;
  return makeHotel(options);
}

/// The inside of the building: its outer walls are seen from within only.
void writeVolume(const Hotel& hotel, double voxel, const std::string& path) {
  FusionOptions options;
  options.voxel_size = voxel;
  options.truncation = 3.0 * voxel;
  Eigen::AlignedBox3d box;
  for (const HotelRoom& room : hotel.rooms) box.extend(room.inside);
  const double margin = std::min(0.15, options.truncation);
  const GridGeometry grid = gridOver(box, voxel, margin);
  // The lattice of a volume begins at the origin.
  const Eigen::Array3i begin = (grid.T_map_grid.translation() / voxel).array().round().cast<int>();
  GridGeometry lattice = grid;
  lattice.T_map_grid.translation() = voxel * begin.cast<double>().matrix();
  const DistanceSampler sampler = [&](const Eigen::Array3i& from, const Dims& size, float* out) {
    sampleDistances(hotel.scene, lattice, from - begin, size, out);
  };
  idealVolume(sampler, begin, grid.dims, options).saveVdb(path);
  const Eigen::Vector3d size = box.sizes();
  double area = 0.0;
  for (const HotelRoom& room : hotel.rooms) area += room.inside.sizes().x() * room.inside.sizes().y();
  std::printf("%zu rooms on %zu storeys, %.1f x %.1f x %.1f m, %.0f m2 of rooms, %zu solids\n",
              hotel.rooms.size(), hotel.tours.size(), size.x(), size.y(), size.z(), area,
              hotel.scene.solids().size());
}

DepthCamera cameraOf(double width_degrees) {
  DepthCameraOptions options;
  options.width = 160, options.height = 120;
  options.fx = options.fy = 80.0 / std::tan(0.5 * width_degrees * M_PI / 180.0);
  options.noise = depthNoise("kinect");
  options.max_range = 5.0;
  return DepthCamera(options);
}

ScanPoints scanOf(const DepthCamera& camera, const Hotel& hotel, const Eigen::Isometry3d& T_map_camera,
                  std::uint64_t frame) {
  return toPoints(camera.render(hotel.scene, T_map_camera, frame), camera.intrinsics(), 2, 0.2, 5.0);
}

/// The newest maps, prepared in the loader's thread.
class NewestMap {
 public:
  void put(PreparedMap map) {
    auto next = std::make_optional(std::move(map));
    const std::lock_guard<std::mutex> lock(mutex_);
    map_.swap(next);
  }
  std::optional<PreparedMap> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(map_, std::nullopt);
  }

 private:
  std::mutex mutex_;
  std::optional<PreparedMap> map_;
};

Eigen::Isometry3d hotelStart(const Hotel& hotel) {
  return Trajectory(hotel.tours.front(), false).sample(1.0).front().T_map_base;
}

/// Poses of the robot from a look round in a room on, along the tour of its storey.
std::vector<Eigen::Isometry3d> wayFrom(const Hotel& hotel, const HotelRoom& room, double rate) {
  const auto poses = Trajectory(hotel.tours[static_cast<std::size_t>(room.storey)], false).sample(rate);
  const Eigen::Vector2d inside = room.door + Eigen::Vector2d(0.1, room.north ? 1.2 : -1.2);
  const auto apart = [&](const StampedPose& pose) {
    return (pose.T_map_base.translation().head<2>() - inside).norm();
  };
  auto first = std::min_element(poses.begin(), poses.end(), [&](const StampedPose& a, const StampedPose& b) {
    return apart(a) < apart(b);
  });
  std::vector<Eigen::Isometry3d> way;
  for (; first != poses.end(); ++first) way.push_back(first->T_map_base);
  return way;
}

/// Storey by storey through all rooms. Between two storeys the robot takes a lift: it is told where it gets
/// out, to 5 cm.
void drive(const std::string& folder, const Hotel& hotel, double rate, double megabytes, int most_rooms) {
  const DepthCamera camera = cameraOf(60.0);
  const Eigen::Isometry3d mount = opticalMount({});
  AtlasLoaderOptions options;
  options.memory_megabytes = megabytes;
  options.map_megabytes = 4.0;
  LocalizerOptions localizer_options;
  localizer_options.recovery.allow_global = false;
  // What the simulation takes, and no robot: the scene and what rendering a scan needs.
  scanOf(camera, hotel, hotelStart(hotel) * mount, 0);
  const double simulation = resident();
  NewestMap newest;
  AtlasLoader loader(folder, readAtlas(folder), options, [&](const std::shared_ptr<const AtlasField>& field) {
    if (field) newest.put(Localizer::prepareWith(field, field->farField(), localizer_options.registration));
  });
  Localizer localizer(localizer_options);
  DriftingOdometry odometry;
  std::vector<double> errors, milliseconds, work, delays, clock_delays, residents;
  int scans = 0, lost = 0, unposed = 0, exchanges = 0, behind = 0, over_budget = 0, wrong = 0;
  std::size_t most_bytes = 0, storey = 0;
  double stamp = 100.0, length = 0.0;
  for (const auto& tour : hotel.tours) {
    std::vector<Waypoint> way = tour;
    if (most_rooms > 0) way.resize(std::min(way.size(), static_cast<std::size_t>(1 + 7 * most_rooms)));
    TrajectoryOptions path;
    const Trajectory trajectory(way, false, path);
    length += trajectory.length();
    const auto poses = trajectory.sample(rate);
    odometry.skip();
    for (std::size_t n = 0; n < poses.size(); ++n) {
      const Eigen::Isometry3d& truth = poses[n].T_map_base;
      stamp += 1.0 / rate;
      const Eigen::Vector3d velocity =
          n == 0 ? Eigen::Vector3d::Zero()
                 : Eigen::Vector3d(rate * (truth.translation() - poses[n - 1].T_map_base.translation()));
      auto begin = Clock::now();
      double busy = threadSeconds();
      loader.want(truth.translation(), velocity);
      if (n == 0) {
        loader.waitUntilSettled(60.0);
        begin = Clock::now(), busy = threadSeconds();
      }
      if (auto map = newest.take()) {
        localizer.exchangeMap(std::move(*map));
        ++exchanges;
      }
      delays.push_back(1e3 * (threadSeconds() - busy));
      clock_delays.push_back(1e3 * since(begin));
      if (n == 0) {
        PoseGuess guess;
        guess.T_map_base = truth;
        guess.T_map_base.translation() += Eigen::Vector3d(0.04, -0.03, 0.0);
        guess.covariance = 2.5e-3 * Matrix6d::Identity();
        localizer.setGuess(guess);
      }
      LocalizerScan scan;
      scan.stamp = stamp;
      scan.T_base_sensor = mount;
      scan.T_odom_base = odometry.update(truth);
      scan.points = scanOf(camera, hotel, truth * mount, static_cast<std::uint64_t>(scans));
      begin = Clock::now(), busy = threadSeconds();
      const LocalizationUpdate update = localizer.process(scan);
      milliseconds.push_back(1e3 * since(begin));
      work.push_back(1e3 * (threadSeconds() - busy));
      ++scans;
      const AtlasLoaderStatus status = loader.status();
      behind += status.behind ? 1 : 0;
      over_budget += status.over_budget > 0 ? 1 : 0;
      most_bytes = std::max(most_bytes, status.bytes);
      residents.push_back(resident());
      lost += localizer.state() == LocalizerState::kLost ? 1 : 0;
      if (update.pose_valid) {
        errors.push_back(1e3 * poseError(update.T_map_sensor, truth * mount).translation);
        wrong += errors.back() > 100.0 ? 1 : 0;
      } else {
        ++unposed;
      }
    }
    std::printf("storey %zu: %zu scans, resident %.1f MB\n", storey++, poses.size(), residents.back());
    std::fflush(stdout);
  }
  double squares = 0.0;
  for (const double e : errors) squares += e * e;
  std::printf(
      "drive: %d scans, %.1f minutes at 0.5 m/s, %.0f m; lost in %d, no pose in %d, rmse %.1f mm, median "
      "%.1f, "
      "99 %% %.1f, largest %.1f mm, %d further than 10 cm\n",
      scans, scans / rate / 60.0, length, lost, unposed,
      std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, errors.size()))),
      quantile(errors, 0.5), quantile(errors, 0.99), quantile(errors, 1.0), wrong);
  std::printf(
      "scan: %.2f ms of work (median), %.2f ms (99 %%), %.2f ms by the clock (median); delayed by loading by "
      "%.3f ms of work at the most, by the clock %.3f ms (99 %%), %.3f ms at the most, more than 5 ms in "
      "%d\n",
      quantile(work, 0.5), quantile(work, 0.99), quantile(milliseconds, 0.5), quantile(delays, 1.0),
      quantile(clock_delays, 0.99), quantile(clock_delays, 1.0),
      static_cast<int>(std::count_if(delays.begin(), delays.end(), [](double ms) { return ms > 5.0; })));
  std::printf(
      "%d exchanges, behind in %d scans, over the budget in %d; maps %.1f MB at most; process %.1f MB before "
      "the robot, %.1f MB after a tenth, %.1f MB at the end, %.1f MB at most: the robot's part is %.1f MB\n",
      exchanges, behind, over_budget, static_cast<double>(most_bytes) / 1048576.0, simulation,
      residents[residents.size() / 10], residents.back(), quantile(residents, 1.0),
      quantile(residents, 1.0) - simulation);
}

/// The same scans in the maps around a room and in the one map that holds it.
void compareWithRoom(const std::string& folder, const Hotel& hotel, double rate, int rooms) {
  const DepthCamera camera = cameraOf(60.0);
  const Eigen::Isometry3d mount = opticalMount({});
  LocalizerOptions options;
  options.recovery.allow_global = false;
  std::vector<double> work[2], ratios;
  for (int r = 0; r < rooms; ++r) {
    const HotelRoom& room =
        hotel.rooms[static_cast<std::size_t>(r) * hotel.rooms.size() / static_cast<std::size_t>(rooms)];
    AtlasLoaderOptions loading;
    AtlasLoader loader(folder, readAtlas(folder), loading);
    loader.want(room.inside.center());
    loader.waitUntilSettled(120.0);
    const auto all = loader.field();
    const auto deepest = std::max_element(
        all->maps().begin(), all->maps().end(), [&](const PlacedField& a, const PlacedField& b) {
          const auto depth = [&](const PlacedField& map) {
            return readAtlas(folder).find(map.name)->box().depth(room.inside.center());
          };
          return depth(a) < depth(b);
        });
    const auto one = std::make_shared<const AtlasField>(std::vector<PlacedField>{*deepest});
    Localizer localizers[2] = {Localizer(options), Localizer(options)};
    localizers[0].setMap(Localizer::prepareWith(all, all->farField(), options.registration));
    localizers[1].setMap(Localizer::prepareWith(one, one->farField(), options.registration));
    bool first = true;
    double stamp = 0.0;
    std::uint64_t frame = 0;
    for (const Eigen::Isometry3d& truth : wayFrom(hotel, room, rate)) {
      if (!room.inside.contains(truth.translation())) break;
      LocalizerScan scan;
      scan.stamp = stamp += 1.0 / rate;
      scan.T_base_sensor = mount;
      scan.T_odom_base = truth;
      scan.points = scanOf(camera, hotel, truth * mount, frame++);
      double spent[2];
      for (const std::size_t k : {frame % 2, 1 - frame % 2}) {
        if (first) {
          PoseGuess guess;
          guess.T_map_base = truth;
          guess.covariance = 2.5e-3 * Matrix6d::Identity();
          localizers[k].setGuess(guess);
        }
        const double busy = threadSeconds();
        localizers[k].process(scan);
        spent[k] = 1e3 * (threadSeconds() - busy);
        work[k].push_back(spent[k]);
      }
      first = false;
      ratios.push_back(spent[0] / spent[1]);
    }
  }
  std::printf(
      "%zu scans in %d rooms: %.2f ms of work a scan in the atlas, %.2f ms in the one map that holds the "
      "room (medians); ratio of the two %.2f (median)\n",
      ratios.size(), rooms, quantile(work[0], 0.5), quantile(work[1], 0.5), quantile(ratios, 0.5));
}

bool isTwin(const Hotel& hotel, const HotelRoom& room) {
  int same = 0;
  for (const HotelRoom& other : hotel.rooms) same += other.design == room.design && other.north == room.north;
  return same > 1;
}

/// A pose of the index from which the right one can be reached.
bool leadsTo(const Eigen::Isometry3d& truth, const PlaceIndex::Hypothesis& one, const Atlas& atlas) {
  const PoseError apart = poseError(truth, one.poseIn(atlas.find(one.map)->box()));
  return apart.translation < 0.4 && apart.rotation < 0.2;
}

/// Scans in the rooms, without a prior, gravity known.
void whichMap(const std::string& folder, const Hotel& hotel, int count, double width, int max_maps) {
  constexpr double kRight = 50.0;  // [mm]
  const DepthCamera camera = cameraOf(width);
  const Eigen::Isometry3d mount = opticalMount({});
  const Atlas atlas = readAtlas(folder);
  AtlasLocatorOptions options;
  options.memory_megabytes = 400.0;  // the figure is about finding, not about loading
  options.map_megabytes = 2.0;
  if (max_maps > 0) options.search.max_maps = max_maps;
  AtlasLocator locator(folder, atlas, options);
  std::map<std::string, int> single, twins;
  std::vector<double> seconds, work, ranks, differences, left, ranking, poses;
  int wrong = 0;
  for (int n = 0; n < count; ++n) {
    const HotelRoom& room =
        hotel.rooms[static_cast<std::size_t>(n) * hotel.rooms.size() / static_cast<std::size_t>(count)];
    const double turn = 2.4 * n, in = room.north ? 1.0 : -1.0;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() =
        Eigen::Vector3d(room.door.x() + 0.1 * (n % 4), room.door.y() + in * (1.0 + 0.1 * (n % 5)),
                        room.inside.min().z() + 1.3);
    T.linear() = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Isometry3d truth = T * mount;
    const ScanPoints scan = scanOf(camera, hotel, truth, static_cast<std::uint64_t>(n));
    const Eigen::Vector3d down = truth.linear().transpose() * -Eigen::Vector3d::UnitZ();
    auto begin = Clock::now();
    const auto ranked = locator.index().rank(scan, down);
    ranking.push_back(since(begin));
    std::size_t place = 0;
    int below = 0;
    for (std::size_t k = 0; k < ranked.size(); ++k) {
      below += ranked[k].difference < options.search.excluded_difference ? 1 : 0;
      if (atlas.find(ranked[k].map)->box().depth(truth.translation()) > 0.3 && place == 0) {
        place = k + 1;
        differences.push_back(ranked[k].difference);
      }
    }
    left.push_back(below);
    const auto hypotheses = locator.index().hypotheses(scan, down);
    std::size_t pose = 0;
    while (pose < hypotheses.size() && !leadsTo(truth, hypotheses[pose], atlas)) ++pose;
    poses.push_back(pose < hypotheses.size() ? static_cast<double>(pose + 1) : INFINITY);
    const double its = pose < hypotheses.size() ? hypotheses[pose].difference : 1.0;
    ranks.push_back(static_cast<double>(place == 0 ? ranked.size() : place));
    begin = Clock::now();
    rusage before{}, after{};
    getrusage(RUSAGE_SELF, &before);
    const AtlasLocation found = locator.locate(scan, down);
    getrusage(RUSAGE_SELF, &after);
    seconds.push_back(since(begin));
    work.push_back(static_cast<double>(after.ru_utime.tv_sec - before.ru_utime.tv_sec) +
                   1e-6 * static_cast<double>(after.ru_utime.tv_usec - before.ru_utime.tv_usec));
    const double error = found.candidates.empty()
                             ? INFINITY
                             : 1e3 * poseError(truth, found.candidates.front().T_atlas_sensor).translation;
    const bool twin = isTwin(hotel, room);
    std::string outcome = found.success ? (error < kRight ? "right" : "wrong") : name(found.reason);
    if (std::getenv("ATLAS_DRIVE_SCANS")) {
      std::printf(
          "%d %s%s: %.0f mm off, map rank %zu of %zu, pose rank %.0f of %zu, difference %.3f, best %.3f, "
          "1000th %.3f, %zu candidates, scores %.3f %.3f, %.1f s\n",
          n, outcome.c_str(), twin ? " (twin)" : "", error, place, ranked.size(), poses.back(),
          hypotheses.size(), its, hypotheses.empty() ? 1.0 : hypotheses.front().difference,
          hypotheses.size() < 1000 ? 1.0 : hypotheses[999].difference, found.candidates.size(),
          found.candidates.empty() ? 1.0 : found.candidates[0].score(),
          found.candidates.size() < 2 ? 1.0 : found.candidates[1].score(), work.back());
      std::fflush(stdout);
    }
    wrong += outcome == "wrong" ? 1 : 0;
    ++(twin ? twins : single)[outcome];
  }
  std::printf("which map, camera of %.0f degrees, %d scans, %zu maps: %d accepted wrongly\n", width, count,
              atlas.maps.size(), wrong);
  for (const auto& [what, list] : {std::pair("rooms", single), std::pair("twins", twins)}) {
    std::printf("  %s:", what);
    for (const auto& [outcome, times] : list) std::printf(" %s %d", outcome.c_str(), times);
    std::printf("\n");
  }
  int first = 0, among = 0;
  for (const double rank : ranks) first += rank <= 1.0 ? 1 : 0, among += rank <= 16.0 ? 1 : 0;
  std::printf(
      "  index: %zu places, %zu bytes, right map first in %d, among sixteen in %d; its difference %.2f "
      "(median), "
      "%.2f (95 %%), %.2f (largest); %.1f maps not excluded (mean); %.3f s to rank (median)\n",
      locator.index().placeCount(), locator.index().memoryBytes(), first, among, quantile(differences, 0.5),
      quantile(differences, 0.95), quantile(differences, 1.0),
      [&] {
        double sum = 0.0;
        for (const double one : left) sum += one;
        return sum / count;
      }(),
      quantile(ranking, 0.5));
  std::printf("  poses of the index: the right one among the first");
  for (const int k : {1, 10, 30, 100, 300, 1000}) {
    int within = 0;
    for (const double rank : poses) within += rank <= k ? 1 : 0;
    std::printf(" %d in %d%s", k, within, k == 1000 ? "\n" : ",");
  }
  std::printf("  a scan: %.2f s by the clock (median), %.2f s of work (median), %.2f s of work at the most\n",
              quantile(seconds, 0.5), quantile(work, 0.5), quantile(work, 1.0));
}

/// How far the robot has to drive from a room on until the atlas knows where it is, without a prior.
void locateMoving(const std::string& folder, const Hotel& hotel, int count, double width, double metres,
                  double megabytes) {
  constexpr double kRate = 4.0, kRight = 50.0, kClose = 100.0;  // [1/s], [mm]
  const DepthCamera camera = cameraOf(width);
  const Eigen::Isometry3d mount = opticalMount({});
  AtlasLocatorOptions options;
  options.memory_megabytes = megabytes;
  options.map_megabytes = 4.0;
  AtlasLocator locator(folder, readAtlas(folder), options);
  int right = 0, close = 0, wrong = 0, never = 0;
  std::vector<double> ways, scans, seconds, errors, twin_ways;
  for (int n = 0; n < count; ++n) {
    const HotelRoom& room =
        hotel.rooms[static_cast<std::size_t>(n) * hotel.rooms.size() / static_cast<std::size_t>(count)];
    OdometryOptions drift;
    drift.odometry_seed = n + 1;
    DriftingOdometry odometry(drift);
    locator.forgetScans();
    double way = 0.0;
    int used = 0;
    bool located = false;
    const auto poses = wayFrom(hotel, room, kRate);
    for (std::size_t k = 0; k < poses.size() && way <= metres && !located; ++k) {
      if (k > 0) way += (poses[k].translation() - poses[k - 1].translation()).norm();
      const Eigen::Isometry3d truth = poses[k] * mount, T_odom_sensor = odometry.update(poses[k]) * mount;
      const ScanPoints scan = scanOf(camera, hotel, truth, static_cast<std::uint64_t>(1000 * n) + k);
      const double before = threadSeconds();
      const AtlasLocation found =
          locator.locateMoving(scan, truth.linear().transpose() * -Eigen::Vector3d::UnitZ(), T_odom_sensor);
      const double work = threadSeconds() - before;
      if (locator.movingScans() == used) continue;
      used = locator.movingScans();
      seconds.push_back(work);
      const auto errorOf = [&](const AtlasCandidate& one) {
        return 1e3 * poseError(truth, one.T_atlas_sensor).translation;
      };
      if (std::getenv("ATLAS_DRIVE_SCANS")) {
        std::printf("%d%s scan %d, %.1f m: %s", n, isTwin(hotel, room) ? " (twin)" : "", used, way,
                    name(found.reason));
        for (std::size_t c = 0; c < std::min<std::size_t>(4, found.candidates.size()); ++c)
          std::printf(", %.0f mm off %.3f/%.3f", errorOf(found.candidates[c]), found.candidates[c].score(),
                      found.candidates[c].mean);
        int rank = 0;
        for (std::size_t c = found.candidates.size(); c-- > 0;)
          rank = errorOf(found.candidates[c]) < 300.0 ? static_cast<int>(c) + 1 : rank;
        std::printf("; right one is %d of %zu, %.2f s\n", rank, found.candidates.size(), work);
        std::fflush(stdout);
      }
      if (!found.success) continue;
      located = true;
      const double error = errorOf(found.candidates.front());
      errors.push_back(error);
      ++(error < kRight ? right : error < kClose ? close : wrong);
      (isTwin(hotel, room) ? twin_ways : ways).push_back(way);
      scans.push_back(used);
    }
    never += located ? 0 : 1;
  }
  std::printf(
      "located by moving, camera of %.0f degrees, %d starts, at most %.0f m: within 5 cm %d, within 10 cm "
      "%d, "
      "wrong %d, not at all %d\n",
      width, count, metres, right, close, wrong, never);
  std::printf(
      "  way: %.1f m (median), %.1f m (90 %%), %.1f m (most); from twins %.1f m (median), %.1f m (most)\n",
      quantile(ways, 0.5), quantile(ways, 0.9), quantile(ways, 1.0), quantile(twin_ways, 0.5),
      quantile(twin_ways, 1.0));
  std::printf(
      "  scans: %.0f (median), %.0f (most); error %.1f mm (median); work a scan %.2f s (median), %.2f s "
      "(most)\n",
      quantile(scans, 0.5), quantile(scans, 1.0), quantile(errors, 0.5), quantile(seconds, 0.5),
      quantile(seconds, 1.0));
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const auto number = [&](int n, double otherwise) { return argc > n ? std::atof(argv[n]) : otherwise; };
  if ((what != "volume" && what != "drive" && what != "which" && what != "moving" && what != "room") ||
      argc < 5) {
    std::fprintf(
        stderr,
        "usage: atlas_hotel volume FILE.vdb STOREYS ROOMS_PER_SIDE VOXEL\n"
        "       atlas_hotel drive ATLAS STOREYS ROOMS_PER_SIDE [SCANS_PER_SECOND MEGABYTES ROOMS]\n"
        "       atlas_hotel room ATLAS STOREYS ROOMS_PER_SIDE [SCANS_PER_SECOND ROOMS]\n"
        "       atlas_hotel which ATLAS STOREYS ROOMS_PER_SIDE [SCANS FIELD_OF_VIEW MAX_MAPS]\n"
        "       atlas_hotel moving ATLAS STOREYS ROOMS_PER_SIDE [STARTS FIELD_OF_VIEW METRES MEGABYTES]\n");
    return 2;
  }
  const Hotel hotel = hotelOf(std::atoi(argv[3]), std::atoi(argv[4]));
  if (what == "volume") {
    writeVolume(hotel, number(5, 0.05), argv[2]);
  } else if (what == "drive") {
    drive(argv[2], hotel, number(5, 5.0), number(6, 40.0), static_cast<int>(number(7, 0)));
  } else if (what == "room") {
    compareWithRoom(argv[2], hotel, number(5, 4.0), static_cast<int>(number(6, 6)));
  } else if (what == "moving") {
    locateMoving(argv[2], hotel, static_cast<int>(number(5, 40)), number(6, 60.0), number(7, 40.0),
                 number(8, 400.0));
  } else {
    whichMap(argv[2], hotel, static_cast<int>(number(5, 40)), number(6, 60.0),
             static_cast<int>(number(7, 0)));
  }
  return 0;
}

// A hotel of many rooms on several storeys as an atlas: its volume, a drive through all of it, and which map
// a scan without a prior was taken in. scripts/atlas_scale runs all of it.
//
// usage: atlas_hotel volume FILE.vdb STOREYS ROOMS_PER_SIDE VOXEL
//        atlas_hotel drive ATLAS STOREYS ROOMS_PER_SIDE [SCANS_PER_SECOND MEGABYTES ROOMS MAP_MEGABYTES]
//        atlas_hotel room ATLAS STOREYS ROOMS_PER_SIDE [SCANS_PER_SECOND ROOMS]
//        atlas_hotel which ATLAS STOREYS ROOMS_PER_SIDE [SCANS FIELD_OF_VIEW MAX_MAPS]
//        atlas_hotel moving ATLAS STOREYS ROOMS_PER_SIDE [STARTS FIELD_OF_VIEW METRES DRIFT MEGABYTES
//        MAP_MEGABYTES]
//
// With ATLAS_DRIVE_SCANS in the environment a drive prints every scan without a pose or further off than 5 cm.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "hotel_benchmark.h"
#include "ttsdf_localization/atlas/atlas_loader.h"
#include "ttsdf_localization/localization/localizer.h"
#include "ttsdf_localization/signed_field/ideal_volume.h"
#include "ttsdf_localization/simulation/drifting_odometry.h"
#include "ttsdf_localization/simulation/scene_sampling.h"
#include "ttsdf_localization/simulation/simulated_rig.h"

namespace {

using namespace ttsdf;  // NOLINT(google-build-using-namespace): a program of one file
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

/// Storey by storey through all rooms. Between two storeys the robot takes a lift: it is told where it gets
/// out, to 5 cm.
void drive(const std::string& folder, const Hotel& hotel, double rate, double megabytes, int most_rooms,
           double map_megabytes) {
  const DepthCamera camera = cameraOf(60.0);
  const Eigen::Isometry3d mount = opticalMount({});
  AtlasLoaderOptions options;
  options.memory_megabytes = megabytes;
  options.map_megabytes = map_megabytes;
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
  std::vector<double> errors, milliseconds, work, delays, clock_delays, waited_delays, residents;
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
      long waits = threadWaits();
      loader.want(truth.translation(), velocity);
      const double delay = threadSeconds() - busy, clock_delay = since(begin);
      const bool waited = threadWaits() > waits;
      // The loader has the time that a robot takes from one scan to the next, at the most.
      loader.waitUntilSettled(n == 0 ? 60.0 : 1.0 / rate);
      begin = Clock::now(), busy = threadSeconds(), waits = threadWaits();
      if (auto map = newest.take()) {
        localizer.exchangeMap(std::move(*map));
        ++exchanges;
      }
      delays.push_back(1e3 * (delay + threadSeconds() - busy));
      clock_delays.push_back(1e3 * (clock_delay + since(begin)));
      if (waited || threadWaits() > waits) waited_delays.push_back(clock_delays.back());
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
      if (std::getenv("ATLAS_DRIVE_SCANS") &&
          (!update.pose_valid || poseError(update.T_map_sensor, truth * mount).translation > 0.05)) {
        std::printf(
            "%.0f s, %.1f %.1f %.1f, turned %.2f: %s, %s, %zu points, score %.3f, outside %.2f, unknown "
            "%.2f, %.0f mm off, %zu maps: %s\n",
            stamp, truth.translation().x(), truth.translation().y(), truth.translation().z(),
            n == 0 ? 0.0 : poseError(poses[n - 1].T_map_base, truth).rotation, name(localizer.state()),
            name(update.registration.reason), static_cast<std::size_t>(scan.points.cols()),
            update.registration.score + update.registration.blocked_ratio, update.registration.outside_ratio,
            update.registration.unknown_ratio,
            1e3 * poseError(update.T_map_sensor, truth * mount).translation, status.in_use.size(),
            update.message.c_str());
        std::fflush(stdout);
      }
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
      "scan: %.2f ms of work (median), %.2f ms (99 %%), %.2f ms by the clock (median)\n"
      "delay of a scan by loading: %.3f ms of work at the most; by the clock %.3f ms (99 %%), %.1f ms at the "
      "most, more than 5 ms in %d; where it waited for the loader, and not for a processor: %zu scans, %.3f "
      "ms "
      "at the most\n",
      quantile(work, 0.5), quantile(work, 0.99), quantile(milliseconds, 0.5), quantile(delays, 1.0),
      quantile(clock_delays, 0.99), quantile(clock_delays, 1.0),
      static_cast<int>(
          std::count_if(clock_delays.begin(), clock_delays.end(), [](double ms) { return ms > 5.0; })),
      waited_delays.size(), waited_delays.empty() ? 0.0 : quantile(waited_delays, 1.0));
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
  const Atlas atlas = readAtlas(folder);
  std::vector<double> work[2], ratios;
  int compared = 0;
  for (int r = 0; r < rooms; ++r) {
    const HotelRoom& room =
        hotel.rooms[static_cast<std::size_t>(r) * hotel.rooms.size() / static_cast<std::size_t>(rooms)];
    AtlasLoaderOptions loading;
    AtlasLoader loader(folder, atlas, loading);
    loader.want(room.inside.center());
    loader.waitUntilSettled(120.0);
    const auto all = loader.field();
    // Rooms that lie over the border of two maps cannot be compared.
    const auto holder = std::find_if(all->maps().begin(), all->maps().end(), [&](const PlacedField& map) {
      const OrientedBox box = atlas.find(map.name)->box();
      return box.depth(room.inside.min()) >= 0.0 && box.depth(room.inside.max()) >= 0.0;
    });
    if (holder == all->maps().end()) continue;
    ++compared;
    const auto one = std::make_shared<const AtlasField>(std::vector<PlacedField>{*holder});
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
      ratios.size(), compared, quantile(work[0], 0.5), quantile(work[1], 0.5), quantile(ratios, 0.5));
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const auto number = [&](int n, double otherwise) { return argc > n ? std::atof(argv[n]) : otherwise; };
  if ((what != "volume" && what != "drive" && what != "which" && what != "moving" && what != "room") ||
      argc < 5) {
    std::fprintf(stderr,
                 "usage: atlas_hotel volume FILE.vdb STOREYS ROOMS_PER_SIDE VOXEL\n"
                 "       atlas_hotel drive ATLAS STOREYS ROOMS_PER_SIDE [SCANS_PER_SECOND MEGABYTES ROOMS "
                 "MAP_MEGABYTES]\n"
                 "       atlas_hotel room ATLAS STOREYS ROOMS_PER_SIDE [SCANS_PER_SECOND ROOMS]\n"
                 "       atlas_hotel which ATLAS STOREYS ROOMS_PER_SIDE [SCANS FIELD_OF_VIEW MAX_MAPS]\n"
                 "       atlas_hotel moving ATLAS STOREYS ROOMS_PER_SIDE [STARTS FIELD_OF_VIEW METRES "
                 "DRIFT MEGABYTES MAP_MEGABYTES]\n");
    return 2;
  }
  const Hotel hotel = hotelOf(std::atoi(argv[3]), std::atoi(argv[4]));
  if (what == "volume") {
    writeVolume(hotel, number(5, 0.05), argv[2]);
  } else if (what == "drive") {
    drive(argv[2], hotel, number(5, 5.0), number(6, 40.0), static_cast<int>(number(7, 0)), number(8, 3.0));
  } else if (what == "room") {
    compareWithRoom(argv[2], hotel, number(5, 4.0), static_cast<int>(number(6, 6)));
  } else if (what == "moving") {
    locateMoving(argv[2], hotel, static_cast<int>(number(5, 40)), number(6, 60.0), number(7, 40.0),
                 number(8, 0.03), number(9, 400.0), number(10, 8.0));
  } else {
    whichMap(argv[2], hotel, static_cast<int>(number(5, 40)), number(6, 60.0),
             static_cast<int>(number(7, 0)));
  }
  return 0;
}

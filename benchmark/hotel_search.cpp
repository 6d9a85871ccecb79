// Scans without a prior in the hotel: one alone, and several of a robot that moves.

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "hotel_benchmark.h"
#include "ttsdf_localization/atlas/atlas_locator.h"
#include "ttsdf_localization/simulation/drifting_odometry.h"
#include "ttsdf_localization/simulation/simulated_rig.h"

namespace ttsdf {

namespace {

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

}  // namespace

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

void locateMoving(const std::string& folder, const Hotel& hotel, int count, double width, double metres,
                  double drift, double megabytes, double map_megabytes) {
  constexpr double kRate = 4.0, kRight = 50.0, kClose = 100.0;  // [1/s], [mm]
  const DepthCamera camera = cameraOf(width);
  const Eigen::Isometry3d mount = opticalMount({});
  AtlasLocatorOptions options;
  options.memory_megabytes = megabytes;
  options.map_megabytes = map_megabytes;
  AtlasLocator locator(folder, readAtlas(folder), options);
  int right = 0, close = 0, wrong = 0, never = 0, in_twins = 0, accepted_in_twins = 0;
  std::vector<double> ways, scans, seconds, errors, twin_ways;
  for (int n = 0; n < count; ++n) {
    const HotelRoom& room =
        hotel.rooms[static_cast<std::size_t>(n) * hotel.rooms.size() / static_cast<std::size_t>(count)];
    OdometryOptions drifting;
    drifting.translation_drift = drifting.rotation_drift = drift;
    drifting.odometry_seed = n + 1;
    DriftingOdometry odometry(drifting);
    locator.forgetScans();
    double way = 0.0;
    int used = 0;
    bool located = false;
    in_twins += isTwin(hotel, room) ? 1 : 0;
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
      accepted_in_twins += isTwin(hotel, room) && room.inside.contains(poses[k].translation()) ? 1 : 0;
      scans.push_back(used);
    }
    never += located ? 0 : 1;
  }
  std::printf(
      "located by moving, camera of %.0f degrees, odometry with %.0f %% drift, %d starts, at most %.0f m: "
      "within 5 cm %d, 5 to 10 cm off %d, wrong %d, not at all %d; %d starts in twins, %d located before the "
      "robot was out of the room\n",
      width, 100.0 * drift, count, metres, right, close, wrong, never, in_twins, accepted_in_twins);
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

}  // namespace ttsdf

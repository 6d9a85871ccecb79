#pragma once
// Which map am I in, where one scan does not say it: motion decides. Places that explain a scan are followed
// by odometry and compared with the scans before and after, until one is left.

#include <functional>
#include <string>
#include <vector>

#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/atlas/atlas_search.h"

namespace ttsdf {

struct MovingSearchOptions {
  int starts = 120;         ///< poses of the index that are tried with each of the first min_scans scans ...
  int later_starts = 30;    ///< ... and with every scan after them
  int followed = 60;        ///< places that are followed at the most
  int scans = 10;           ///< the newest ones; places are compared by what they make of these
  double step = 0.3;        ///< a scan counts once the robot has moved so far since the last one [m] ...
  double turn = 0.35;       ///< ... or turned [rad]
  int min_scans = 3;        ///< before a place is accepted
  double max_score = 0.25;  ///< a worse score + blocked_ratio, mean of the scans or newest, is not accepted
  double lead = 0.15;    ///< the scores of all other places are worse than an accepted one's by this, in sum
  double refuted = 0.5;  ///< a place that is worse than the best by this is dropped
  double drift = 0.03;   ///< odometry is off by this share of the way [m/m], [rad/m]
  RegistrationOptions registration = quickRegistration();

  /// Fewer points and no restarts: hundreds of poses are tried, most of them wrong.
  static RegistrationOptions quickRegistration();
};
/// Throws std::invalid_argument for what is out of range.
void check(const MovingSearchOptions& options);

/// Maps, and what is known about all of them without loading them.
struct SearchedAtlas {
  const Atlas& atlas;
  const PlaceIndex& index;
  MapsAround maps;
};

/// Not thread-safe.
class MovingSearch {
 public:
  explicit MovingSearch(const MovingSearchOptions& options = {});

  /// The next scan of a moving robot; gravity must be known. `T_odom_sensor`: the odometry's pose of the
  /// sensor when it was taken. A scan from where the last one was taken says nothing new: the answer stays.
  /// kConverged: the first candidate is the pose. kAmbiguous: motion must go on. kLowScore: no place explains
  /// the scans. kUnsure: too few scans yet, the newest does not show the place, or a map that may hold it
  /// cannot be used. Where `progress` cancels, the scan is forgotten. Never throws for bad points.
  AtlasLocation add(const SearchedAtlas& where, const ScanPoints& points, const Eigen::Vector3d& down_sensor,
                    const Eigen::Isometry3d& T_odom_sensor, const ProgressCallback& progress = {});
  /// The robot was carried elsewhere, or its odometry jumped: begins again.
  void clear();
  /// Scans that counted.
  int scans() const { return count_; }

 private:
  struct Scan {
    ScanPoints points;
    Eigen::Isometry3d T_odom_sensor;
  };
  /// Where the newest scan may have been taken, and what it makes of the scans.
  struct Place {
    std::string map;
    Eigen::Isometry3d T_atlas_sensor;
    RegistrationResult result;   ///< of the newest scan
    std::vector<double> scores;  ///< of the scans, the newest last
    double sum() const;
  };
  class Area;

  bool moved(const Eigen::Isometry3d& T_odom_sensor) const;
  std::vector<Place> predicted(const Eigen::Isometry3d& T_odom_sensor) const;
  std::vector<Place> startsOf(const SearchedAtlas& where, const Scan& scan,
                              const Eigen::Vector3d& down_sensor, const std::vector<Place>& known) const;
  Matrix6d driftOver(const Eigen::Isometry3d& T_before_after) const;
  bool inTheirMaps(const SearchedAtlas& where, std::vector<Place>& places, const ProgressCallback& progress,
                   const std::function<void(Area&, Place&)>& use);
  void lookBack(Area& area, const Scan& newest, Place& place) const;
  void keep(std::vector<Place> places);
  AtlasLocation decide() const;

  MovingSearchOptions options_;
  std::vector<Scan> scans_;    ///< the newest last
  std::vector<Place> places_;  ///< the best first
  int count_ = 0;
  bool all_read_ = true;  ///< maps of all places that the newest scan was compared with
  AtlasLocation answer_;
};

}  // namespace ttsdf

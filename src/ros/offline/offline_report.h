#pragma once
// What an offline run leaves behind: a trajectory (TUM), one line of CSV per scan, and a summary.

#include <std_msgs/Header.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/LocalizationStatus.h"
#include "ttsdf_localization/files/file_writer.h"
#include "ttsdf_localization/localization/localization_types.h"

namespace ttsdf {

class OfflineReport {
 public:
  using Status = ttsdf_localization::LocalizationStatus;

  struct Paths {
    std::string trajectory, covariances, statuses;  ///< empty: not written
  };
  /// `with_times` adds a column of milliseconds, which no two runs agree on.
  OfflineReport(const Paths& paths, bool with_times);

  void add(const std_msgs::Header& header, const Status& status, const LocalizationUpdate& update);
  /// Finishes the files. Throws std::runtime_error.
  void close();

  /// Some lines of text: scans, poses, states, times lost, distance, milliseconds. `seconds`: wall time of
  /// the run.
  std::string summary(double seconds, int global_localizations) const;
  int scans() const { return scans_; }
  int poses() const { return poses_; }
  int timesLost() const { return times_lost_; }
  /// Of the registrations; 0: there was none.
  double medianMilliseconds() const;
  /// Why there is no pose: what was said most often; empty if there is one.
  std::string reasonForNoPose() const;

 private:
  void writeStatus(const std_msgs::Header& header, const Status& status, const LocalizationUpdate& update);

  OutputFile trajectory_, covariances_, statuses_;
  const bool with_times_;
  int scans_ = 0, poses_ = 0, times_lost_ = 0;
  double distance_ = 0.0;              ///< along the trajectory [m]
  std::optional<double> first_stamp_;  ///< [s]
  double last_stamp_ = 0.0;            ///< [s]
  std::optional<Eigen::Vector3d> last_position_;
  std::string last_state_;
  std::map<std::string, int> states_;  ///< scans per state
  struct Complaint {
    int count = 0;
    std::string message;  ///< the last one
  };
  std::map<int, Complaint> complaints_;  ///< of scans without a pose, by reason
  std::vector<double> milliseconds_;     ///< of every registration
};

}  // namespace ttsdf

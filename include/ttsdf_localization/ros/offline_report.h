#pragma once
// What an offline run leaves behind: a trajectory (TUM), one line of CSV per scan, and a summary.

#include <std_msgs/Header.h>

#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/LocalizationStatus.h"
#include "ttsdf_localization/localization/localization_types.h"

namespace ttsdf {

/// A text file written beside its name and renamed by close(): a run that fails leaves no half of it.
class OutputFile {
 public:
  /// An empty path: nothing is written. Throws std::runtime_error naming the path, as close() does.
  explicit OutputFile(std::string path);
  ~OutputFile();
  std::ostream& stream() { return stream_; }
  void close();

 private:
  const std::string path_;
  std::ofstream stream_;
  bool open_ = false;
};

class OfflineReport {
 public:
  using Status = ttsdf_localization::LocalizationStatus;

  /// Empty paths: not written. `with_times` adds a column of milliseconds, which no two runs agree on.
  OfflineReport(const std::string& trajectory_path, const std::string& status_path, bool with_times);

  void add(const std_msgs::Header& header, const Status& status, const LocalizationUpdate& update);
  /// Finishes the files. Throws std::runtime_error.
  void close();

  /// Some lines of text: scans, poses, states, times lost, distance, milliseconds. `seconds`: wall time of
  /// the run.
  std::string summary(double seconds, int global_localizations) const;
  int scans() const { return scans_; }
  int poses() const { return poses_; }

 private:
  void writeStatus(const std_msgs::Header& header, const Status& status, const LocalizationUpdate& update);

  OutputFile trajectory_, statuses_;
  const bool with_times_;
  int scans_ = 0, poses_ = 0, times_lost_ = 0;
  double distance_ = 0.0;              ///< along the trajectory [m]
  std::optional<double> first_stamp_;  ///< [s]
  double last_stamp_ = 0.0;            ///< [s]
  std::optional<Eigen::Vector3d> last_position_;
  std::string last_state_;
  std::map<std::string, int> states_;  ///< scans per state
  std::vector<double> milliseconds_;   ///< of every registration
};

}  // namespace ttsdf

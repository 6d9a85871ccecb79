#pragma once
// What ttsdf_register reads and writes.

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {

/// Points of a scan (readers/cloud_file.h: .pcd, .ply, .bin, .xyz, ...), non-finite ones included. Throws
/// std::runtime_error naming the file.
ScanPoints readScan(const std::string& path);

/// One line of a batch list: `scan prior [truth]`, names as written there, those with blanks in double
/// quotes.
struct BatchEntry {
  std::string scan, prior;
  std::optional<std::string> truth;
};

/// Blank lines and lines that begin with '#' are left out. Throws std::runtime_error naming file and line.
std::vector<BatchEntry> readBatch(const std::string& path);

/// A name of the list as a path: as written if such a file exists, otherwise relative to the list's folder.
std::string resolveBeside(const std::string& list_path, const std::string& name);

/// The header of ttsdf_register's output, without line end.
extern const char* const kRegistrationCsvHeader;

struct RegistrationRow {
  std::string scan, prior;
  Eigen::Index points = 0;  ///< finite points of the scan
  RegistrationResult result;
  bool unreadable = false;  ///< the scan or a pose could not be read: no result, reason "unreadable"
  double milliseconds = 0.0;
  std::optional<PoseError> error;
};

void writeRow(std::ostream& out, const RegistrationRow& row);

/// Scan, number of weak directions, and the covariance row by row: twists [rotation; translation] of the map
/// frame about the sensor's position, in radians and metres. Empty cells without an estimate that may be
/// used.
void writeUncertaintyHeader(std::ostream& out);
void writeUncertainty(std::ostream& out, const RegistrationRow& row);

}  // namespace ttsdf

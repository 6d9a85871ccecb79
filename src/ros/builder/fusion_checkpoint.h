#pragma once
// The fused volume outlives the node: it is kept in a file and taken up again at the next start.

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "ros/builder/scan_fuser.h"

namespace ttsdf {

/// Thread-safe.
class FusionCheckpoint {
 public:
  /// An empty `file`: nothing is kept.
  FusionCheckpoint(std::string file, const FusionOptions& fusion);

  bool kept() const { return !file_.empty(); }
  /// The volume of the file, if there is one. Throws std::invalid_argument and std::runtime_error: a path
  /// that is not absolute or cannot be written, no such volume, voxels of another size.
  std::optional<TsdfVolume> read() const;
  /// Keeps what `fuser` holds if scans were fused since the last time. What stands in the way is logged.
  void write(ScanFuser& fuser);
  /// Removes the file.
  void forget();
  /// Why the last one was not written; empty if it was, and while one is being written.
  std::string problem() const;

 private:
  const std::string file_;
  const FusionOptions fusion_;
  mutable std::mutex mutex_;
  std::uint32_t kept_scans_ = 0;  ///< fused scans in the file
  std::string problem_;
};

}  // namespace ttsdf

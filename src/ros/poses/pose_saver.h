#pragma once
// Writes the last good pose in a thread of its own: a slow disk holds up nobody.

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "ttsdf_localization/localization/localization_types.h"

namespace ttsdf {

class PoseSaver {
 public:
  /// An empty path: nothing is saved.
  PoseSaver(std::string path, std::string frame_id);
  /// Writes what was put last.
  ~PoseSaver();
  PoseSaver(const PoseSaver&) = delete;
  PoseSaver& operator=(const PoseSaver&) = delete;

  /// Replaces what is not written yet.
  void put(PoseGuess pose);

 private:
  void run();

  const std::string path_, frame_id_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<PoseGuess> pose_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace ttsdf

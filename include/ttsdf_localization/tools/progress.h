#pragma once
// How far a long run is, on stderr: a line that is redrawn on a terminal, and elsewhere a line of its own
// whenever nothing was said for four seconds. A thread of its own speaks where the work does not.

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace ttsdf {

class Progress {
 public:
  /// `program` begins the lines of its own.
  explicit Progress(std::string program = {});
  /// Erases the line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `share` in [0, 1]. Redrawn ten times a second at most.
  void update(const std::string& step, double share);
  /// A whole line of its own, behind the program's name: shown on any stderr, above the progress.
  void note(const std::string& text);
  void warn(const std::string& text) { note("warning: " + text); }

 private:
  using Clock = std::chrono::steady_clock;
  void watch();
  void say();
  void erase();

  const std::string program_;
  const bool terminal_;
  const Clock::time_point begin_ = Clock::now();
  std::mutex mutex_;
  std::condition_variable ended_;
  bool drawn_ = false, end_ = false;
  std::string step_;
  double share_ = 0.0;
  Clock::time_point last_word_ = begin_;
  std::thread watch_;
};

}  // namespace ttsdf

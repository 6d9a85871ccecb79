#pragma once
// One line on stderr that says how far a long run is, and nothing where stderr is no terminal.

#include <chrono>
#include <string>

namespace ttsdf {

class Progress {
 public:
  Progress();
  /// Erases the line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `share` in [0, 1]. Redrawn ten times a second at most.
  void update(const std::string& step, double share);
  /// A whole line of its own (a warning): shown on any stderr, above the progress.
  void note(const std::string& line);

 private:
  void erase();
  bool terminal_;
  bool drawn_ = false;
  std::string step_;
  std::chrono::steady_clock::time_point last_draw_;
};

}  // namespace ttsdf

#pragma once
// Runs one global localization at a time in a thread of its own.

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "ttsdf_localization/localization/localizer.h"

namespace ttsdf {

class GlobalWorker {
 public:
  struct Callbacks {
    std::function<void(GlobalJob& job, const ProgressCallback& progress)> run;
    std::function<void(double share)> progress;      ///< from the worker's thread
    std::function<void(const GlobalJob& job)> done;  ///< from the worker's thread
  };
  explicit GlobalWorker(Callbacks callbacks) : callbacks_(std::move(callbacks)) {}
  ~GlobalWorker();
  GlobalWorker(const GlobalWorker&) = delete;
  GlobalWorker& operator=(const GlobalWorker&) = delete;

  /// False if one is running (a cancelled one runs until it notices).
  bool start(GlobalJob& job);
  /// True if one was running.
  bool cancel();
  bool running() const { return running_; }
  /// The one that runs, or ran last.
  bool cancelled() const { return cancelled_; }
  double progress() const { return progress_; }
  /// Waits until nothing runs.
  void wait();

 private:
  void run();

  const Callbacks callbacks_;
  std::mutex mutex_;
  std::condition_variable idle_;
  std::unique_ptr<GlobalJob> job_;
  std::atomic<bool> running_{false}, cancelled_{false};
  std::atomic<double> progress_{0.0};
  std::thread thread_;
};

}  // namespace ttsdf

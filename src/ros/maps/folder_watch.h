#pragma once
// Tells when the files of an atlas' folder were written.

#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace ttsdf {

/// Another text whenever atlas.yaml or the index of places was written; never throws for what is not there.
std::string stateOfAtlas(const std::string& folder);

/// Looks in a thread of its own, so that reading a large atlas.yaml delays nobody.
class FolderWatch {
 public:
  /// `changed` runs in that thread, once for each change since `seen`; what it throws goes to `failed`.
  FolderWatch(std::string folder, std::string seen, double period, std::function<void()> changed,
              std::function<void(const std::string&)> failed);
  /// Waits for a call that runs.
  ~FolderWatch();
  FolderWatch(const FolderWatch&) = delete;
  FolderWatch& operator=(const FolderWatch&) = delete;

 private:
  void run();

  const std::string folder_;
  std::string seen_;
  const double period_;  ///< [s]
  const std::function<void()> changed_;
  const std::function<void(const std::string&)> failed_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false;
  std::thread thread_;  ///< last: it uses the others
};

}  // namespace ttsdf

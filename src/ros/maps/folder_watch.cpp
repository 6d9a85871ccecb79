#include "ros/maps/folder_watch.h"

#include <chrono>
#include <exception>
#include <filesystem>
#include <system_error>
#include <utility>

#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/atlas/place_index_file.h"

namespace ttsdf {

std::string stateOfAtlas(const std::string& folder) {
  namespace fs = std::filesystem;
  std::string text;
  for (const char* name : {kAtlasFile, kPlaceIndexFile}) {
    std::error_code error;
    const fs::path path = fs::path(folder) / name;
    const auto time = fs::last_write_time(path, error);
    text += error ? std::string("none ") : std::to_string(time.time_since_epoch().count()) + ' ';
    const auto size = fs::file_size(path, error);
    text += error ? std::string("none ") : std::to_string(size) + ' ';
  }
  return text;
}

FolderWatch::FolderWatch(std::string folder, std::string seen, double period, std::function<void()> changed,
                         std::function<void(const std::string&)> failed)
    : folder_(std::move(folder)),
      seen_(std::move(seen)),
      period_(period),
      changed_(std::move(changed)),
      failed_(std::move(failed)),
      thread_([this] { run(); }) {}

FolderWatch::~FolderWatch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void FolderWatch::run() {
  const std::chrono::duration<double> period(period_);
  std::unique_lock<std::mutex> lock(mutex_);
  while (!wake_.wait_for(lock, period, [this] { return stop_; })) {
    std::string now = stateOfAtlas(folder_);
    if (now == seen_) continue;
    seen_ = std::move(now);
    lock.unlock();
    try {
      changed_();
    } catch (const std::exception& error) {
      failed_(error.what());
    }
    lock.lock();
  }
}

}  // namespace ttsdf

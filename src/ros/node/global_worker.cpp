#include "ros/node/global_worker.h"

#include <ros/console.h>

#include <exception>
#include <system_error>
#include <utility>

namespace ttsdf {

GlobalWorker::~GlobalWorker() {
  cancelled_ = true;
  if (thread_.joinable()) thread_.join();
}

bool GlobalWorker::start(GlobalJob& job) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (running_) return false;
  if (thread_.joinable()) thread_.join();  // has ended
  job_ = std::make_unique<GlobalJob>(std::move(job));
  running_ = true;
  cancelled_ = false;
  progress_ = 0.0;
  try {
    thread_ = std::thread(&GlobalWorker::run, this);
  } catch (const std::system_error& error) {
    ROS_ERROR_STREAM("global localization: no thread for it: " << error.what());
    running_ = false;
    job = std::move(*job_);
  }
  return running_;
}

bool GlobalWorker::cancel() {
  cancelled_ = true;
  return running_;
}

void GlobalWorker::wait() {
  std::unique_lock<std::mutex> lock(mutex_);
  idle_.wait(lock, [this] { return !running_; });
}

void GlobalWorker::run() {
  // Out of memory, say: the job then counts as cancelled, and the process, which is shared, lives on.
  try {
    callbacks_.run(*job_, [this](double share) {
      progress_ = share;
      callbacks_.progress(share);
      return !cancelled_;
    });
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM("global localization: " << error.what());
  }
  try {
    callbacks_.done(*job_);
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM("global localization: " << error.what());
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  running_ = false;
  idle_.notify_all();
}

}  // namespace ttsdf

#include "ros/poses/pose_saver.h"

#include <ros/console.h>

#include <exception>
#include <utility>

#include "ros/poses/pose_store.h"

namespace ttsdf {

PoseSaver::PoseSaver(std::string path, std::string frame_id)
    : path_(std::move(path)), frame_id_(std::move(frame_id)) {
  if (!path_.empty()) thread_ = std::thread(&PoseSaver::run, this);
}

PoseSaver::~PoseSaver() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void PoseSaver::put(PoseGuess pose) {
  if (path_.empty()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    pose_ = std::move(pose);
  }
  changed_.notify_all();
}

void PoseSaver::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stop_ || pose_; });
    if (!pose_) return;
    const PoseGuess pose = *std::exchange(pose_, std::nullopt);
    lock.unlock();
    try {
      savePose(path_, frame_id_, pose);
    } catch (const std::exception& error) {
      ROS_ERROR_STREAM_THROTTLE(60.0, error.what());
    }
    lock.lock();
  }
}

}  // namespace ttsdf

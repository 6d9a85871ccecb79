#pragma once
// Threads for a callback queue. Those of ros::AsyncSpinner wake up ten times a second to see whether they
// shall end; these sleep until something comes, and end when they are destroyed, not with ros::ok().

#include <ros/callback_queue.h>

#include <atomic>
#include <thread>
#include <vector>

namespace ttsdf {

class QueueThreads {
 public:
  QueueThreads(ros::CallbackQueue& queue, int count) : queue_(queue) {
    try {
      for (int n = 0; n < count; ++n) threads_.emplace_back([this] { run(); });
    } catch (...) {  // the system gives no more threads
      stop();
      throw;
    }
  }
  /// Waits for what is being called; what waits in the queue is not called any more.
  ~QueueThreads() { stop(); }
  QueueThreads(const QueueThreads&) = delete;
  QueueThreads& operator=(const QueueThreads&) = delete;

 private:
  void run() {
    while (!stopping_) {
      if (queue_.callOne(ros::WallDuration(kLook)) == ros::CallbackQueue::Disabled) return;
    }
  }
  void stop() {
    stopping_ = true;
    queue_.disable();
    for (std::thread& thread : threads_) thread.join();
  }

  static constexpr double kLook = 5.0;  // [s]; it is woken up when the queue is disabled
  ros::CallbackQueue& queue_;
  std::atomic<bool> stopping_{false};
  std::vector<std::thread> threads_;
};

}  // namespace ttsdf

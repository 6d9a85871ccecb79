#pragma once
// A queue of one: a newer value replaces the one that waits, so that a slow consumer always gets the newest.

#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>

namespace ttsdf {

template <class Value>
class NewestSlot {
 public:
  /// Returns true if a waiting value was replaced.
  bool put(Value value) {
    bool replaced;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      replaced = value_.has_value();
      value_ = std::move(value);
    }
    changed_.notify_one();
    return replaced;
  }
  /// Waits for a value; empty after close().
  std::optional<Value> take() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return closed_ || value_; });
    if (closed_) return std::nullopt;
    return std::exchange(value_, std::nullopt);
  }
  void clear() {
    const std::lock_guard<std::mutex> lock(mutex_);
    value_.reset();
  }
  void close() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
    }
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Value> value_;
  bool closed_ = false;
};

}  // namespace ttsdf

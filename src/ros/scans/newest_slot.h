#pragma once
// A queue of one: a newer value replaces the one that waits, so that a slow consumer always gets the newest.

#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>

namespace ttsdf {

/// Thread-safe.
template <class Value>
class NewestSlot {
 public:
  /// Returns true if one of two values was dropped for the other: the one that waited, unless
  /// `isNewer(value, waiting)` is false.
  template <class IsNewer>
  bool put(Value value, const IsNewer& isNewer) {
    bool dropped;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      dropped = value_.has_value();
      if (!dropped || isNewer(value, *value_)) value_ = std::move(value);
    }
    changed_.notify_one();
    return dropped;
  }
  bool put(Value value) {
    return put(std::move(value), [](const Value&, const Value&) { return true; });
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

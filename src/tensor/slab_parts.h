#pragma once
// Work on the slabs of an array by several threads, with results that do not depend on how many there are.

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace ttsdf {

/// Partial sums of a reduction over slabs: fixed, so that the order of summation is.
constexpr int kSlabParts = 8;

/// Runs work(part, begin, end) over `parts` equal ranges of [0, count) on `threads` threads (the calling one
/// is one of them). The first exception of `work` reaches the caller.
template <class Work>
void overParts(int count, int parts, int threads, const Work& work) {
  std::exception_ptr failure;
  std::mutex guard;
  std::atomic<int> next{0};
  const auto run = [&] {
    try {
      for (int part = next++; part < parts; part = next++) {
        const auto begin = static_cast<int>(static_cast<long>(count) * part / parts);
        const auto end = static_cast<int>(static_cast<long>(count) * (part + 1) / parts);
        if (begin < end) work(part, begin, end);
      }
    } catch (...) {
      const std::lock_guard<std::mutex> lock(guard);
      if (!failure) failure = std::current_exception();
    }
  };
  std::vector<std::thread> helpers;
  try {
    for (int thread = 1; thread < threads; ++thread) helpers.emplace_back(run);
  } catch (const std::system_error&) {
    // The system gives no more threads: those there are do the work.
  }
  run();
  for (auto& helper : helpers) helper.join();
  if (failure) std::rethrow_exception(failure);
}

/// Columns of a slab that are worked on at a time: they stay in the second-level cache.
constexpr int kSlabColumns = 64;

/// fn(begin, size) for the columns [0, count) in portions of kSlabColumns.
template <class Function>
void overColumns(int count, const Function& fn) {
  for (int begin = 0; begin < count; begin += kSlabColumns) fn(begin, std::min(kSlabColumns, count - begin));
}

}  // namespace ttsdf

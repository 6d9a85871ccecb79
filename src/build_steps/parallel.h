#pragma once
// Loops over slices on a bounded number of threads, with progress and cancellation from the calling thread.

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "ttsdf_localization/build_steps/build_options.h"

namespace ttsdf {

/// One named step of a longer job.
class ProgressStep {
 public:
  ProgressStep(const BuildProgress& progress, std::string name)
      : progress_(progress), name_(std::move(name)) {
    report(0.0);
  }
  /// Throws std::runtime_error("cancelled") if the listener says so.
  void report(double share) const {
    if (progress_ && !progress_(name_, share)) throw std::runtime_error("cancelled");
  }

 private:
  const BuildProgress& progress_;
  std::string name_;
};

/// fn(k) for every k in [0, count), each k by one thread. Exceptions of fn reach the caller.
template <class Function>
void parallelFor(int count, int threads, const Function& fn) {
  // TBB grumbles on stderr when asked for more threads than there are cores.
  tbb::task_arena arena(std::clamp(threads, 1, tbb::this_task_arena::max_concurrency()));
  arena.execute([&] { tbb::parallel_for(0, count, fn); });
}

/// The same with a report between portions of the range.
template <class Function>
void parallelFor(int count, int threads, const ProgressStep& step, const Function& fn) {
  const int portion = std::max(8 * threads, count / 20 + 1);
  for (int begin = 0; begin < count; begin += portion) {
    const int size = std::min(portion, count - begin);
    parallelFor(size, threads, [&](int k) { fn(begin + k); });
    step.report(static_cast<double>(begin + size) / count);
  }
}

}  // namespace ttsdf

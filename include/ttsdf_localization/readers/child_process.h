#pragma once
// Libraries that a damaged file can crash, hang or fill the memory with run in a process of their own.

#include <cstddef>
#include <functional>
#include <string>

namespace ttsdf {

struct ChildLimits {
  double seconds = 20.0;  ///< of the processor; of the wall clock six times as much, for busy machines
  std::size_t memory_bytes = std::size_t{1} << 29;  ///< beyond what this process already has
  std::size_t result_bytes = std::size_t{1} << 32;
};

/// Limits that grow with a file, for formats that compress.
ChildLimits limitsForFile(const std::string& path);

/// Runs `work` in a forked process and returns what it returns. An exception of `work` arrives as
/// std::runtime_error with the same text; a crash, an abort, too much memory or time as
/// std::runtime_error("WHAT: the file is damaged (...)"). What the child prints is dropped. `work` must not
/// use threads, and what it changes stays in the child.
std::string runInChild(const std::string& what, const ChildLimits& limits,
                       const std::function<std::string()>& work);

}  // namespace ttsdf

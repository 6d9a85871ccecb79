#pragma once
// The memory table's raw figures: what the map of each method takes, one CSV row per data set and method.

#include <cstddef>
#include <string>
#include <vector>

namespace ttsdf {

struct MethodMemory {
  std::string dataset, method;
  std::size_t paper_bytes = 0;  ///< by the paper's formula
  std::size_t memory_bytes =
      0;  ///< as measured: what the heap shrinks by when the method goes, caches filled
};

/// Bytes in use on the heap of this process (glibc's count); 0 where the library does not say.
std::size_t heapBytes();

/// The rows of such a file; none if it does not exist. Throws std::runtime_error for another kind of file.
std::vector<MethodMemory> readMethodMemory(const std::string& path);

/// Adds a row, or replaces that of the same data set and method. Throws std::runtime_error if the file cannot
/// be read or written.
void recordMethodMemory(const std::string& path, const MethodMemory& row);

}  // namespace ttsdf

#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace ttsdf {

/// The median, of an even number of values the upper of the two in the middle. Reorders `values`, which must
/// not be empty. O(n).
template <class T>
T upperMedian(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace ttsdf

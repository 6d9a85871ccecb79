#include "ttsdf_localization/evaluation/statistics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace ttsdf {

namespace {

void sortChecked(std::vector<double>& values) {
  if (values.empty()) throw std::invalid_argument("quantile: got an empty list, wanted at least one value");
  if (std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); })) {
    throw std::invalid_argument("quantile: got NaN in the list, wanted numbers");
  }
  std::sort(values.begin(), values.end());
}

double quantileOfSorted(const std::vector<double>& sorted, double p) {
  if (!(p >= 0.0 && p <= 1.0)) {
    throw std::invalid_argument("quantile: got p = " + std::to_string(p) + ", wanted a value from 0 to 1");
  }
  const double position = p * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double share = position - static_cast<double>(below);
  if (share == 0.0) return sorted[below];  // keeps an infinite neighbour out of the sum
  return sorted[below] + share * (sorted[above] - sorted[below]);
}

}  // namespace

double quantile(std::vector<double> values, double p) {
  sortChecked(values);
  return quantileOfSorted(values, p);
}

Quartiles quartiles(std::vector<double> values) {
  sortChecked(values);
  return {quantileOfSorted(values, 0.25), quantileOfSorted(values, 0.5), quantileOfSorted(values, 0.75)};
}

}  // namespace ttsdf

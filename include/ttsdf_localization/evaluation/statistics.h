#pragma once

// Order statistics of the evaluation.

#include <vector>

namespace ttsdf {

/// Quantile by linear interpolation between order statistics (Hyndman and Fan's type 7, the default of NumPy
/// and R). Throws std::invalid_argument for an empty list, NaN in it, or p outside [0, 1].
double quantile(std::vector<double> values, double p);

struct Quartiles {
  double q1 = 0.0, median = 0.0, q3 = 0.0;
};

/// Throws as quantile does.
Quartiles quartiles(std::vector<double> values);

}  // namespace ttsdf

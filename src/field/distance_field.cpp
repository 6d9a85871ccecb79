#include "ttsdf_localization/field/distance_field.h"

#include <stdexcept>

namespace ttsdf {

Interpolation interpolationFromName(const std::string& text) {
  if (text == "nearest") return Interpolation::kNearest;
  if (text == "trilinear") return Interpolation::kTrilinear;
  throw std::invalid_argument("interpolation: got '" + text + "', wanted nearest or trilinear");
}

const char* name(Interpolation interpolation) {
  return interpolation == Interpolation::kNearest ? "nearest" : "trilinear";
}

FieldSamples DistanceField::evaluate(const Eigen::Matrix3Xf& points_map) const {
  const Eigen::Index n = points_map.cols();
  const Eigen::VectorXf x = points_map.row(0), y = points_map.row(1), z = points_map.row(2);
  FieldSamples samples;
  samples.values.resize(n);
  samples.gradients.resize(3, n);
  samples.states.resize(static_cast<std::size_t>(n));
  Eigen::VectorXf gx(n), gy(n), gz(n);
  evaluate(PointSpan{x.data(), y.data(), z.data(), static_cast<int>(n)},
           SampleSpan{samples.values.data(), gx.data(), gy.data(), gz.data(), samples.states.data()});
  samples.gradients.row(0) = gx;
  samples.gradients.row(1) = gy;
  samples.gradients.row(2) = gz;
  return samples;
}

}  // namespace ttsdf

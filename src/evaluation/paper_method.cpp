// The paper's registration, as it is written (section III): plain Gauss-Newton over all points, no weights
// and no kernel, the field and its gradient at the nearest voxel.

#include <Eigen/Cholesky>
#include <algorithm>

#include "ttsdf_localization/evaluation/method.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

namespace {

constexpr Eigen::Index kMinPoints = 6;

// H = sum J^T J and b = sum J^T f with J = grad^T [-x^ | I] at x = T p. Points outside the box have no voxel
// and are left out.
struct NormalEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  Eigen::Index points = 0;
};

NormalEquations linearized(const DistanceField& field, const Eigen::Matrix3Xf& points_map) {
  const FieldSamples samples = field.evaluate(points_map);
  NormalEquations sum;
  for (Eigen::Index n = 0; n < points_map.cols(); ++n) {
    if (samples.states[static_cast<std::size_t>(n)] == PointState::kOutside) continue;
    const Eigen::Vector3d x = points_map.col(n).cast<double>(), g = samples.gradients.col(n).cast<double>();
    Vector6d J;
    J << x.cross(g), g;
    sum.H += J * J.transpose();
    sum.b += static_cast<double>(samples.values[n]) * J;
    ++sum.points;
  }
  return sum;
}

class PaperMethod final : public Method {
 public:
  PaperMethod(std::shared_ptr<const DistanceField> field, const PaperMethodOptions& options)
      : field_(std::move(field)), options_(options) {}

  Estimate estimate(const ScanPoints& points, const Eigen::Isometry3d& T_map_prior,
                    const std::optional<Eigen::Vector3d>&) override {
    const GridGeometry& geometry = field_->geometry();  // the field's points are relative to its origin
    Estimate result{relativeTo(geometry, T_map_prior), false, 0, "max_iterations"};
    int small_steps = 0;  // "two consecutive steps"
    while (result.iterations < options_.max_iterations && small_steps < 2) {
      const auto system = linearized(*field_, (result.T_map_sensor.cast<float>() * points).eval());
      if (system.points < kMinPoints) return {T_map_prior, false, result.iterations, "outside_map"};
      const Vector6d step = -system.H.ldlt().solve(system.b);
      if (!step.allFinite()) return {T_map_prior, false, result.iterations, "degenerate"};
      result.T_map_sensor = expSe3(step) * result.T_map_sensor;
      ++result.iterations;
      small_steps = step.norm() < options_.epsilon ? small_steps + 1 : 0;
    }
    if (small_steps == 2) result.reason = "converged";
    result.accepted = true;  // the paper has no test of the outcome
    result.T_map_sensor = inMapFrame(geometry, result.T_map_sensor);
    return result;
  }
  std::size_t paperBytes() const override { return fieldPaperBytes(*field_); }

 private:
  std::shared_ptr<const DistanceField> field_;
  PaperMethodOptions options_;
};

}  // namespace

const OptionTable<PaperMethodOptions>& paperMethodOptionTable() {
  static const OptionTable<PaperMethodOptions> kTable = [] {
    using O = PaperMethodOptions;
    OptionTable<O> table;
    table.add("max_iterations", &O::max_iterations, 1, 10000, "", "Iterations at most.")
        .add("epsilon", &O::epsilon, 0.0, 1.0, "",
             "Length of a step [rad, m] below which two in a row end it.");
    return table;
  }();
  return kTable;
}

std::unique_ptr<Method> makePaperMethod(std::shared_ptr<const DistanceField> field,
                                        const PaperMethodOptions& options) {
  return std::make_unique<PaperMethod>(std::move(field), options);
}

}  // namespace ttsdf

#pragma once
// A distance field is asked for many points at once: registration never calls it per point.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "ttsdf_localization/field/frame_agreement.h"
#include "ttsdf_localization/field/grid_geometry.h"

namespace ttsdf {

enum class PointState : std::uint8_t {
  kValid = 0,    ///< value and gradient mean something
  kUnknown = 1,  ///< inside the box, but the map knows nothing here: carries no information
  kOutside = 2,  ///< outside the box
};

enum class Interpolation { kNearest, kTrilinear };

Interpolation interpolationFromName(
    const std::string& name);  ///< "nearest" | "trilinear"; throws std::invalid_argument
const char* name(Interpolation interpolation);

/// `size` points of the map frame [m], relative to the field's geometry().origin; structure of arrays.
struct PointSpan {
  const float* x;
  const float* y;
  const float* z;
  int size;
};

/// Results for a PointSpan. Where the state is not kValid, value and gradient are 0, except that kUnknown
/// points keep the field's value and gradient for those who want them anyway.
struct SampleSpan {
  float* value;       ///< signed distance [m], positive in free space
  float* gradient_x;  ///< map frame, dimensionless (1 for an exact distance)
  float* gradient_y;
  float* gradient_z;
  PointState* state;
};

/// Owning result of the convenience overload.
struct FieldSamples {
  Eigen::VectorXf values;
  Eigen::Matrix3Xf gradients;
  std::vector<PointState> states;
};

/// Asked during long work: false ends it with Cancelled. Empty: nobody asks.
using KeepGoing = std::function<bool()>;

class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

/// Throws Cancelled if `keep_going` says so.
inline void goOn(const KeepGoing& keep_going) {
  if (keep_going && !keep_going()) throw Cancelled();
}

class DistanceField {
 public:
  virtual ~DistanceField() = default;
  virtual const GridGeometry& geometry() const = 0;
  /// Values, gradients (map frame) and states of a batch. Non-finite points are kOutside. Safe to call from
  /// several threads.
  virtual void evaluate(const PointSpan& points, const SampleSpan& samples) const = 0;
  /// The same, but far from the surfaces a field may take values and gradients from `far`, its far field,
  /// where that costs less. States are its own.
  virtual void evaluate(const PointSpan& points, const DistanceField& far, const SampleSpan& samples) const {
    static_cast<void>(far);
    evaluate(points, samples);
  }
  /// Bytes this field holds in memory, caches included.
  virtual std::size_t memoryBytes() const = 0;
  /// Makes ahead of the first scan what the field keeps around the surface, if anything. `keep_going` is
  /// asked every few milliseconds; false: Cancelled, and the field answers as before.
  virtual void warmUp(const KeepGoing& keep_going = {}) const { static_cast<void>(keep_going); }
  /// These places and what is around them are asked for next, again and again: what the field would make on
  /// the way it may make now, all at once. Changes no answer.
  virtual void prepare(const PointSpan& points) const { static_cast<void>(points); }
  /// The order of axes in which a walk through the field costs least, the innermost loop last.
  virtual std::array<int, 3> walkOrder() const { return {{2, 1, 0}}; }

  /// The same for points of the map frame relative to geometry().origin.
  FieldSamples evaluate(const Eigen::Matrix3Xf& points_map) const;

  /// What is known about the errors of the map itself; default: nothing. To be set before the field is
  /// shared.
  const FrameAgreement& agreement() const { return agreement_; }
  void setAgreement(const FrameAgreement& agreement) { agreement_ = agreement; }

 private:
  FrameAgreement agreement_;
};

}  // namespace ttsdf

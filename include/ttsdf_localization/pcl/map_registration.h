#pragma once
// A map behind PCL's interface of registrations, for programs that are written around pcl::Registration.
// Header only: who includes it has PCL and links ttsdf_core.

#include <pcl/common/transforms.h>
#include <pcl/registration/registration.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/registration/search.h"

namespace ttsdf {

/// setInputTarget takes a map instead of a cloud; setInputSource, align, getFinalTransformation and
/// hasConverged are PCL's. PCL's matrices are single precision: fine up to a kilometre from the map's origin;
/// beyond, ask result() for the pose. Not thread-safe, as all of PCL's registrations.
template <typename PointSource, typename PointTarget = PointSource>
class MapRegistration : public pcl::Registration<PointSource, PointTarget, float> {
  using Base = pcl::Registration<PointSource, PointTarget, float>;

 public:
  using Base::setInputTarget;
  using typename Base::Matrix4;
  using typename Base::PointCloudSource;
  using typename Base::PointCloudTarget;

  explicit MapRegistration(RegistrationOptions options = {}) : options_(std::move(options)) {
    this->reg_name_ = "MapRegistration";
  }

  /// Also makes a thin cloud of the map's surface, which is what PCL knows as the target. Throws as makeField
  /// and Registration do.
  void setInputTarget(const TtSdfMap& map) {
    std::shared_ptr<const DistanceField> field = makeField(map);
    Base::setInputTarget(surfaceCloud(*field));
    registration_ = std::make_unique<ttsdf::Registration>(std::move(field), options_);
  }
  /// Reads a map file. Throws as loadMap.
  void setInputTarget(const std::string& map_file) { setInputTarget(loadMap(map_file)); }

  /// Starts around the guess, for guesses that are off by half a metre.
  void setSearch(bool search) { search_ = search; }

  /// Mean square distance of the aligned source to the map's surface [m^2], of the points nearer than
  /// `max_range` in known space; infinity if there are none. Hides the base class's, which looks for
  /// neighbours in the thin cloud.
  double getFitnessScore(double max_range = 0.2) {
    if (!registration_ || !this->input_) return std::numeric_limits<double>::infinity();
    const DistanceField& field = registration_->field();
    const Eigen::Isometry3d T = relativeTo(field.geometry(), result_.T_map_sensor);
    const ScanPoints points = sourcePoints();
    const FieldSamples samples = field.evaluate(
        ((T.linear() * points.cast<double>()).colwise() + T.translation()).template cast<float>().eval());
    double sum = 0.0, count = 0.0;
    for (Eigen::Index n = 0; n < points.cols(); ++n) {
      const double distance = std::abs(static_cast<double>(samples.values[n]));
      if (samples.states[static_cast<std::size_t>(n)] != PointState::kValid || distance > max_range) continue;
      sum += distance * distance;
      count += 1.0;
    }
    return count > 0.0 ? sum / count : std::numeric_limits<double>::infinity();
  }

  /// Everything that is known of the last alignment: pose in double precision, covariance, reason.
  const RegistrationResult& result() const { return result_; }

 protected:
  void computeTransformation(PointCloudSource& output, const Matrix4& guess) override {
    this->converged_ = false;
    this->final_transformation_ = guess;
    if (registration_) {
      const Eigen::Isometry3d T_guess = orthonormalized(guess.template cast<double>());
      const ScanPoints points = sourcePoints();
      result_ = search_ ? searchNear(*registration_, points, T_guess, SearchOptions())
                        : registration_->align(points, T_guess);
      this->converged_ = result_.success;
      this->final_transformation_ = result_.T_map_sensor.matrix().template cast<float>();
      this->transformation_ = this->final_transformation_;
      this->nr_iterations_ = result_.iterations;
    }
    pcl::transformPointCloud(*this->input_, output, this->final_transformation_);
  }

 private:
  ScanPoints sourcePoints() const {
    ScanPoints points(3, static_cast<Eigen::Index>(this->input_->size()));
    for (Eigen::Index n = 0; n < points.cols(); ++n) {
      points.col(n) = (*this->input_)[static_cast<std::size_t>(n)].getVector3fMap();
    }
    return points;
  }

  /// Every second sample within a voxel of the surface, moved onto it.
  static typename PointCloudTarget::Ptr surfaceCloud(const DistanceField& field) {
    typename PointCloudTarget::Ptr cloud(new PointCloudTarget);
    const GridGeometry& g = field.geometry();
    const auto reach = static_cast<float>(g.voxel_size);
    Eigen::Matrix3Xf line(3, (g.dims[0] + 1) / 2);
    for (int k = 0; k < g.dims[2]; k += 2) {
      for (int j = 0; j < g.dims[1]; j += 2) {
        for (Eigen::Index i = 0; i < line.cols(); ++i) {
          line.col(i) =
              g.samplePosition(Eigen::Vector3d(2.0 * static_cast<double>(i), j, k)).template cast<float>();
        }
        const FieldSamples samples = field.evaluate(line);
        for (Eigen::Index i = 0; i < line.cols(); ++i) {
          if (samples.states[static_cast<std::size_t>(i)] != PointState::kValid ||
              std::abs(samples.values[i]) > reach)
            continue;
          PointTarget point;
          point.getVector3fMap() =
              line.col(i) - samples.values[i] * samples.gradients.col(i) + g.origin.template cast<float>();
          cloud->push_back(point);
        }
      }
    }
    return cloud;
  }

  RegistrationOptions options_;
  std::unique_ptr<ttsdf::Registration> registration_;
  RegistrationResult result_;
  bool search_ = false;
};

}  // namespace ttsdf

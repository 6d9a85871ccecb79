#include <algorithm>

#include "ttsdf_localization/evaluation/method.h"
#include "ttsdf_localization/field/dense_distance_field.h"
#include "ttsdf_localization/field/derivative_core_field.h"
#include "ttsdf_localization/field/tt_distance_field.h"

namespace ttsdf {

namespace {

Estimate toEstimate(const RegistrationResult& result) {
  return {result.T_map_sensor, result.success,    result.iterations,
          name(result.reason), result.covariance, result.confidence};
}

class PriorMethod final : public Method {
 public:
  Estimate estimate(const ScanPoints&, const Eigen::Isometry3d& T_map_prior,
                    const std::optional<Eigen::Vector3d>&) override {
    return {T_map_prior, true, 0, "prior"};
  }
  std::size_t paperBytes() const override { return 0; }
};

class FieldMethod : public Method {
 public:
  FieldMethod(std::shared_ptr<const DistanceField> field, const RegistrationOptions& options)
      : field_(std::move(field)), registration_(field_, options) {}
  std::size_t paperBytes() const override { return fieldPaperBytes(*field_); }

 protected:
  std::shared_ptr<const DistanceField> field_;
  Registration registration_;
};

class TrackMethod final : public FieldMethod {
 public:
  using FieldMethod::FieldMethod;
  Estimate estimate(const ScanPoints& points, const Eigen::Isometry3d& T_map_prior,
                    const std::optional<Eigen::Vector3d>&) override {
    return toEstimate(registration_.align(points, T_map_prior));
  }
};

class SearchMethod final : public FieldMethod {
 public:
  SearchMethod(std::shared_ptr<const DistanceField> field, const RegistrationOptions& options,
               SearchOptions search)
      : FieldMethod(std::move(field), options), search_(search) {}
  Estimate estimate(const ScanPoints& points, const Eigen::Isometry3d& T_map_prior,
                    const std::optional<Eigen::Vector3d>&) override {
    return toEstimate(searchNear(registration_, points, T_map_prior, search_));
  }

 private:
  SearchOptions search_;
};

class GlobalMethod final : public FieldMethod {
 public:
  GlobalMethod(std::shared_ptr<const DistanceField> field, const RegistrationOptions& options,
               GlobalOptions global, const Eigen::Vector3d& map_down)
      : FieldMethod(std::move(field), options), global_(global), map_down_(map_down) {}
  Estimate estimate(const ScanPoints& points, const Eigen::Isometry3d&,
                    const std::optional<Eigen::Vector3d>& gravity) override {
    return toEstimate(localizeGlobally(registration_, points, gravity, map_down_, global_));
  }

 private:
  GlobalOptions global_;
  Eigen::Vector3d map_down_;
};

}  // namespace

std::unique_ptr<Method> makePriorMethod() { return std::make_unique<PriorMethod>(); }

std::unique_ptr<Method> makeTrackMethod(std::shared_ptr<const DistanceField> field,
                                        const RegistrationOptions& options) {
  return std::make_unique<TrackMethod>(std::move(field), options);
}

std::unique_ptr<Method> makeSearchMethod(std::shared_ptr<const DistanceField> field,
                                         const RegistrationOptions& options, const SearchOptions& search) {
  return std::make_unique<SearchMethod>(std::move(field), options, search);
}

std::unique_ptr<Method> makeGlobalMethod(std::shared_ptr<const DistanceField> field,
                                         const RegistrationOptions& options, const GlobalOptions& global,
                                         const Eigen::Vector3d& map_down) {
  return std::make_unique<GlobalMethod>(std::move(field), options, global, map_down);
}

std::shared_ptr<const DistanceField> makeEvaluationField(const TtSdfMap& map, Interpolation interpolation,
                                                         bool dense, double memory_megabytes) {
  if (dense) {
    auto field = std::make_shared<DenseDistanceField>(full(map.train), relativeToOrigin(map.geometry),
                                                      map.mask, interpolation);
    field->setAgreement(map.agreement);
    return field;
  }
  TtFieldOptions options;
  options.interpolation = interpolation;
  options.memory_megabytes = memory_megabytes;
  return makeField(map, options);
}

std::size_t fieldPaperBytes(const DistanceField& field) {
  const auto* compressed = dynamic_cast<const TtDistanceField*>(&field);
  if (compressed) {
    return tensorTrainPaperBytes(compressed->modeSizes(), compressed->rank1(), compressed->rank2());
  }
  if (const auto* cores = dynamic_cast<const DerivativeCoreField*>(&field)) {
    const TensorTrain& train = cores->train();
    return tensorTrainPaperBytes(train.modeSizes(), train.rank1(), train.rank2());
  }
  return densePaperBytes(field.geometry().dims);
}

std::size_t densePaperBytes(const Dims& dims) {
  return sizeof(float) * static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
         static_cast<std::size_t>(dims[2]);
}

std::size_t tensorTrainPaperBytes(const TensorTrain& train) {
  return tensorTrainPaperBytes(train.modeSizes(), train.rank1(), train.rank2());
}

std::size_t tensorTrainPaperBytes(const std::array<int, 3>& sizes, int rank1, int rank2) {
  const auto rank = static_cast<std::size_t>(std::max(rank1, rank2));
  return sizeof(float) * rank *
         (static_cast<std::size_t>(sizes[0]) + static_cast<std::size_t>(sizes[1]) * rank +
          static_cast<std::size_t>(sizes[2]));
}

std::size_t cloudPaperBytes(std::size_t points) { return sizeof(float) * 3 * points; }

std::size_t featurePaperBytes(std::size_t features, std::size_t dimensions) {
  return sizeof(float) * features * dimensions;
}

}  // namespace ttsdf

#include "ttsdf_localization/field/derivative_core_field.h"

#include <gtest/gtest.h>

#include "field_oracle.h"
#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/field/dense_distance_field.h"

namespace ttsdf {
namespace {

TEST(DerivativeCoreField, EqualsFiniteDifferencesOfTheFullArrayAtTheNearestVoxel) {
  const Dims dims(30, 23, 26);
  const GridGeometry geometry = test::turnedGeometry(dims);
  TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = 9;
  const TensorTrain train = ttSvd(test::distanceTensor(dims), options).train;
  const DerivativeCoreField field(train, geometry);
  const DenseDistanceField dense(full(train), geometry, {}, Interpolation::kNearest);
  const Eigen::Matrix3Xf points = test::randomPoints(geometry, 2000, 0.0, 0.01);
  const FieldSamples a = field.evaluate(points), b = dense.evaluate(points);
  EXPECT_LT((a.values - b.values).cwiseAbs().maxCoeff(), 1e-5f);
  EXPECT_LT((a.gradients - b.gradients).cwiseAbs().maxCoeff(),
            1e-5f / static_cast<float>(geometry.voxel_size));
  EXPECT_EQ(a.states, b.states);
  EXPECT_EQ(field.memoryBytes(), 2 * train.memoryBytes());
}

TEST(DerivativeCoreField, RefusesATrainOfAnotherGrid) {
  EXPECT_THROW(DerivativeCoreField(TensorTrain(), test::turnedGeometry(Dims(4, 4, 4))),
               std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf

#pragma once
// What the benchmarks measure on: part of the simulated apartment in a grid of the size of the paper's red
// kitchen (346 x 153 x 152 samples of 2 cm), and a scan of about 4 300 points seen from inside.

#include <memory>

#include "ttsdf_localization/field/dense_distance_field.h"
#include "ttsdf_localization/frames/depth_image.h"
#include "ttsdf_localization/registration/registration.h"
#include "ttsdf_localization/simulation/analytic_scene.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

const AnalyticScene& benchmarkScene();
GridGeometry benchmarkGeometry();
/// Exact distances, clamped to [-0.06, 0.2] m. Made once.
const DenseTensor& benchmarkArray();
/// Rank cap `rank` on both sides. Made once per rank.
const TensorTrain& benchmarkTrain(int rank);

struct BenchmarkScan {
  DepthImage image;
  CameraIntrinsics intrinsics;
  ScanPoints points;  ///< every 8th pixel
  Eigen::Isometry3d T_map_sensor;
};
const BenchmarkScan& benchmarkScan();

std::shared_ptr<const DistanceField> benchmarkDenseField();
std::shared_ptr<const DistanceField> benchmarkTrainField(int rank, Interpolation interpolation);

}  // namespace ttsdf

#include "benchmark_world.h"

#include <algorithm>
#include <map>

#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/field/tt_distance_field.h"
#include "ttsdf_localization/simulation/depth_camera.h"
#include "ttsdf_localization/simulation/scene_sampling.h"
#include "ttsdf_localization/simulation/worlds.h"

namespace ttsdf {

namespace {
constexpr float kClampNegative = 0.06f, kClampPositive = 0.2f;
constexpr int kStride = 8;
}  // namespace

const AnalyticScene& benchmarkScene() {
  static const AnalyticScene kScene = makeApartment();
  return kScene;
}

GridGeometry benchmarkGeometry() {
  GridGeometry geometry;
  geometry.dims = Dims(346, 152, 153);
  geometry.voxel_size = 0.02;
  geometry.T_map_grid.translation() << -0.2, -0.2, -0.2;
  return geometry;
}

const DenseTensor& benchmarkArray() {
  static const DenseTensor kArray = [] {
    DenseTensor array = sampleDistances(benchmarkScene(), benchmarkGeometry());
    for (std::size_t n = 0; n < array.size(); ++n) {
      array.data()[n] = std::clamp(array.data()[n], -kClampNegative, kClampPositive);
    }
    return array;
  }();
  return kArray;
}

const TensorTrain& benchmarkTrain(int rank) {
  static std::map<int, TensorTrain> trains;
  auto found = trains.find(rank);
  if (found == trains.end()) {
    TtSvdOptions options;
    options.max_rank1 = options.max_rank2 = rank;
    found = trains.emplace(rank, ttSvd(benchmarkArray(), options).train).first;
  }
  return found->second;
}

const BenchmarkScan& benchmarkScan() {
  static const BenchmarkScan kScan = [] {
    BenchmarkScan scan;
    // An optical frame (z forward, x right, y down) that looks along +x and a little down.
    Eigen::Matrix3d R_map_optical;
    R_map_optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    scan.T_map_sensor = Eigen::Isometry3d::Identity();
    scan.T_map_sensor.translation() << 1.2, 1.4, 1.4;
    scan.T_map_sensor.linear() = R_map_optical * Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitX());
    const DepthCamera camera;
    scan.image = camera.render(benchmarkScene(), scan.T_map_sensor);
    scan.intrinsics = camera.intrinsics();
    scan.points = toPoints(scan.image, scan.intrinsics, kStride, 0.2, 4.0);
    return scan;
  }();
  return kScan;
}

std::shared_ptr<const DistanceField> benchmarkDenseField() {
  return std::make_shared<DenseDistanceField>(benchmarkArray(), benchmarkGeometry());
}

std::shared_ptr<const DistanceField> benchmarkTrainField(int rank, Interpolation interpolation) {
  TtFieldOptions options;
  options.interpolation = interpolation;
  return std::make_shared<TtDistanceField>(benchmarkTrain(rank), benchmarkGeometry(), SupportMask(), options);
}

}  // namespace ttsdf

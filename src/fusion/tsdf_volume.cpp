#include "ttsdf_localization/fusion/tsdf_volume.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <stdexcept>

#include "cloud_fusion.h"
#include "depth/depth_fusion.h"
#include "ttsdf_localization/fusion/tsdf_volume_grids.h"
#include "ttsdf_localization/geometry/local_origin.h"
#include "ttsdf_localization/sensor/sensor_model.h"

namespace ttsdf {

namespace {

void checkOptions(const FusionOptions& options) {
  fusionOptionTable().validate(options);
  const auto refuse = [](const std::string& name, double got, const std::string& wanted, double bound) {
    throw std::invalid_argument("option '" + name + "': got " + toString(got) + ", wanted " + wanted + " " +
                                toString(bound) + " [m]");
  };
  if (options.truncation < options.voxel_size) {
    refuse("truncation", options.truncation, "at least voxel_size", options.voxel_size);
  }
  if (options.max_depth <= options.min_depth) {
    refuse("max_depth", options.max_depth, "more than min_depth", options.min_depth);
  }
}

void checkPose(const Eigen::Isometry3d& pose) {
  if (!pose.matrix().allFinite())
    throw std::invalid_argument("pose of a scan: got NaN or infinity, wanted a rigid motion");
  const double error =
      (pose.linear() * pose.linear().transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > 1e-3 || pose.linear().determinant() < 0.0) {
    throw std::invalid_argument("pose of a scan: got a rotation block that is off by " + toString(error) +
                                " or mirrored, wanted a rotation");
  }
  constexpr double kFarthest = 1e8;  // [m]: no place on Earth has larger coordinates
  const double distance = pose.translation().cwiseAbs().maxCoeff();
  if (distance > kFarthest) {
    throw std::invalid_argument("pose of a scan: got a position " + toString(distance) +
                                " m from zero, wanted up to " + toString(kFarthest) + " m");
  }
}

/// TBB prints a warning when asked for more threads than it has.
int concurrency(const FusionOptions& options) {
  return std::min(options.threads, tbb::this_task_arena::max_concurrency());
}

TsdfVolume::Grids emptyGrids(const FusionOptions& options) {
  TsdfVolume::Grids grids;
  const auto transform = openvdb::math::Transform::createLinearTransform(options.voxel_size);
  grids.tsdf = openvdb::FloatGrid::create(static_cast<float>(options.truncation));
  grids.tsdf->setGridClass(openvdb::GRID_LEVEL_SET);
  grids.weight = openvdb::FloatGrid::create(0.0F);
  grids.free = openvdb::MaskGrid::create(false);
  grids.tsdf->setTransform(transform->copy());
  grids.weight->setTransform(transform->copy());
  grids.free->setTransform(transform->copy());
  grids.tsdf->setName("tsdf");
  grids.weight->setName("weight");
  grids.free->setName("free");
  return grids;
}

}  // namespace

const OptionTable<FusionOptions>& fusionOptionTable() {
  using O = FusionOptions;
  static const OptionTable<FusionOptions> table = [] {
    OptionTable<FusionOptions> t;
    t.add("voxel_size", &O::voxel_size, 0.0005, 10.0, "m",
          "Edge of a voxel: half a centimetre for objects, 2 to 5 cm for rooms and buildings.")
        .add("truncation", &O::truncation, 0.0005, 100.0, "m",
             "Half width of the band of signed distances around surfaces; at least one voxel, three are "
             "usual, more with a noisy camera.")
        .add("min_depth", &O::min_depth, 0.0, 100.0, "m", "Nearer readings are ignored.")
        .add("max_depth", &O::max_depth, 0.01, 200.0, "m",
             "Farther readings carve free space only, up to here.")
        .add("max_weight", &O::max_weight, 1.0, 1e6, "",
             "Cap of a voxel's weight (1: one frame head on within 1 m); later frames then count as a moving "
             "average.")
        .add("carve", &O::carve, "Mark what rays crossed as free and remove what stood there before.")
        .add("sensor", &O::sensor, sensorNames(),
             "How readings are weighed over range, at edges and at grazing angles.")
        .add("threads", &O::threads, 1, 256, "", "Threads of a fusion step.");
    return t;
  }();
  return table;
}

TsdfVolume::TsdfVolume(FusionOptions options) : options_(options) {
  static std::once_flag openvdb_ready;
  std::call_once(openvdb_ready, [] { openvdb::initialize(); });
  checkOptions(options_);
  grids_ = std::make_unique<Grids>(emptyGrids(options_));
}

TsdfVolume::~TsdfVolume() = default;
TsdfVolume::TsdfVolume(TsdfVolume&&) noexcept = default;
TsdfVolume& TsdfVolume::operator=(TsdfVolume&&) noexcept = default;

void TsdfVolume::integrate(const DepthImage& image, const CameraIntrinsics& intrinsics,
                           const Eigen::Isometry3d& T_map_camera) {
  checkFits(image, intrinsics);
  checkPose(T_map_camera);
  tbb::task_arena arena(concurrency(options_));
  const Eigen::Isometry3d T = relativeToOrigin(T_map_camera);
  arena.execute([&] { fuseDepthImage(*grids_, options_, image, intrinsics, T); });
  ++grids_->frame_count;
}

void TsdfVolume::integrate(const Eigen::Matrix3Xf& points, const Eigen::Isometry3d& T_map_sensor) {
  checkPose(T_map_sensor);
  tbb::task_arena arena(concurrency(options_));
  const Eigen::Isometry3d T = relativeToOrigin(T_map_sensor);
  arena.execute([&] { fuseCloud(*grids_, options_, points, T); });
  ++grids_->frame_count;
}

Eigen::Isometry3d TsdfVolume::relativeToOrigin(const Eigen::Isometry3d& T_map_sensor) {
  const Eigen::Vector3d& t = T_map_sensor.translation();
  if (grids_->frame_count == 0 && empty()) origin_ = localOrigin(t, t);
  // OpenVDB's indices are 32-bit integers, and single precision ends before.
  constexpr double kFarthest = 1e5;  // [m]
  const double distance = (t - origin_).cwiseAbs().maxCoeff();
  if (distance > kFarthest) {
    throw std::invalid_argument("pose of a scan: got a position " + toString(distance) +
                                " m away from the volume's origin, wanted up to " + toString(kFarthest) +
                                " m");
  }
  Eigen::Isometry3d T = T_map_sensor;
  T.translation() -= origin_;
  return T;
}

const FusionOptions& TsdfVolume::options() const { return options_; }
std::size_t TsdfVolume::frameCount() const { return grids_->frame_count; }
bool TsdfVolume::empty() const { return grids_->tsdf->activeVoxelCount() == 0; }

std::size_t TsdfVolume::memoryBytes() const {
  return grids_->tsdf->memUsage() + grids_->weight->memUsage() + grids_->free->memUsage();
}

const TsdfVolume::Grids& TsdfVolume::grids() const { return *grids_; }
TsdfVolume::Grids& TsdfVolume::grids() { return *grids_; }

}  // namespace ttsdf

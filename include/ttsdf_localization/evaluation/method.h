#pragma once
// What the evaluation compares: anything that turns a scan and a prior into a pose.

#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "ttsdf_localization/evaluation/scan_set.h"
#include "ttsdf_localization/map/tt_sdf_map.h"
#include "ttsdf_localization/registration/search.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

struct Estimate {
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  bool accepted = false;  ///< the method itself says that the estimate may be used
  int iterations = 0;
  std::string reason;
  /// Of the left perturbation [rotation; translation] about the sensor's position, as RegistrationResult's.
  std::optional<Matrix6d> covariance = std::nullopt;
  double confidence =
      std::numeric_limits<double>::quiet_NaN();  ///< that the pose is right [0, 1]; NaN: not said
};

class Method {
 public:
  virtual ~Method() = default;
  /// `gravity`: the down direction in the sensor frame, for those who can use it. Everything done per scan
  /// belongs in here: the call is what gets timed.
  virtual Estimate estimate(const ScanPoints& points, const Eigen::Isometry3d& T_map_prior,
                            const std::optional<Eigen::Vector3d>& gravity) = 0;
  /// Bytes of the map as the paper counts them (section VI, Metrics).
  virtual std::size_t paperBytes() const = 0;
};

/// Returns the prior: the floor of every comparison, and the check of the evaluation itself.
std::unique_ptr<Method> makePriorMethod();

/// One start from the prior.
std::unique_ptr<Method> makeTrackMethod(std::shared_ptr<const DistanceField> field,
                                        const RegistrationOptions& options);
/// Many starts around the prior.
std::unique_ptr<Method> makeSearchMethod(std::shared_ptr<const DistanceField> field,
                                         const RegistrationOptions& options, const SearchOptions& search);
/// The whole map; the prior is not used. `map_down`: the down direction in the map frame.
std::unique_ptr<Method> makeGlobalMethod(std::shared_ptr<const DistanceField> field,
                                         const RegistrationOptions& options, const GlobalOptions& global,
                                         const Eigen::Vector3d& map_down);

/// The paper's registration: Gauss-Newton over all points, neither weights nor kernel. The field says where
/// it is evaluated: at the nearest voxel in the paper.
struct PaperMethodOptions {
  int max_iterations = 50;
  double epsilon = 1e-4;  ///< two steps in a row shorter than this end it [rad, m]
};
const OptionTable<PaperMethodOptions>& paperMethodOptionTable();
std::unique_ptr<Method> makePaperMethod(std::shared_ptr<const DistanceField> field,
                                        const PaperMethodOptions& options = {});

/// Settings of the point cloud baselines; the defaults are the best found on the red kitchen.
struct CloudMethodOptions {
  double max_correspondence_distance = 1.0;  ///< [m]
  int max_iterations = 200;
  double epsilon = 1e-4;        ///< change of the transform below which they stop
  int normal_neighbours = 20;   ///< plane fits: normals and GICP covariances
  double ndt_resolution = 0.5;  ///< NDT's cell [m]
  double ndt_step = 0.1;        ///< NDT's largest line search step [m]
  double feature_cell = 0.05;   ///< FPFH: the scan is thinned to this, as the map is; normals take twice the
                                ///< radius, features five times [m]
  int ransac_iterations = 100000;  ///< poses tried at the most by sample consensus
};
const OptionTable<CloudMethodOptions>& cloudMethodOptionTable();

/// PCL's registration against a map cloud [m]: kind "icp" (point to point), "icp_plane", "gicp" or "ndt".
/// Throws std::invalid_argument for another kind or an empty cloud.
std::unique_ptr<Method> makeCloudMethod(const std::string& kind, const Eigen::Matrix3Xf& map_cloud,
                                        const CloudMethodOptions& options = {});

/// Open3D's registration: kind "open3d_icp", "open3d_icp_plane"; without a prior, by FPFH descriptors of map
/// and scan, "fgr" (Fast Global Registration) or "ransac". Throws std::invalid_argument for another kind or
/// an empty cloud, std::runtime_error if this build has no Open3D.
std::unique_ptr<Method> makeOpen3dMethod(const std::string& kind, const MapCloud& map_cloud,
                                         const CloudMethodOptions& options = {});
bool hasOpen3d();

/// Of a compressed field by the formula for trains, of another by that for arrays.
std::size_t fieldPaperBytes(const DistanceField& field);
/// The field of a map, compressed (within a bound on its memory) or (`dense`) as a full array.
std::shared_ptr<const DistanceField> makeEvaluationField(
    const TtSdfMap& map, Interpolation interpolation, bool dense,
    double memory_megabytes = TtFieldOptions().memory_megabytes);

/// Bytes of a field of dims x floats (the paper's W x H x L).
std::size_t densePaperBytes(const Dims& dims);
/// The paper's formula takes one rank R = max(r1, r2): (n1 R + n2 R^2 + n3 R) floats in chain order.
std::size_t tensorTrainPaperBytes(const TensorTrain& train);
std::size_t tensorTrainPaperBytes(const std::array<int, 3>& mode_sizes, int rank1, int rank2);
/// N x 3 floats (the paper counts a sparse map so), and K x D floats of a feature map.
std::size_t cloudPaperBytes(std::size_t points);
std::size_t featurePaperBytes(std::size_t features, std::size_t dimensions);

}  // namespace ttsdf

#pragma once
// Scans with their true poses, from whatever holds them.

#include <string>
#include <vector>

#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/registration/registration.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

struct EvaluationScan {
  std::string name;
  int index = 0;                                                   ///< seeds the perturbations
  ScanPoints points;                                               ///< sensor frame [m]
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();  ///< the truth
};

struct ScanSet {
  std::vector<EvaluationScan> scans;
  std::vector<std::string> skipped;  ///< why a frame could not be used
};

struct FrameSelection {
  int every = 10;
  int offset = 5;          ///< frames with index % every == offset
  int stride = 8;          ///< every 8th pixel in both directions
  double min_depth = 0.2;  ///< [m]
  double max_depth = 4.0;  ///< [m]
};

/// Where simulated frames have poses with errors, as a mapping system would record them,
/// frame-NNNNNN.truth.txt beside them has the exact one: scans are compared with that, maps are made of the
/// recorded poses.
enum class PoseKind { kTruth, kRecorded };

/// Unreadable frames are skipped and listed. Throws std::runtime_error if no frame is left.
ScanSet scansFromFrames(const FrameFolder& folder, const FrameSelection& selection,
                        PoseKind poses = PoseKind::kTruth);

/// A point cloud map. Descriptors such as FPFH need normals that point to one side: `towards_sensor` says
/// which.
struct MapCloud {
  Eigen::Matrix3Xf points;          ///< map frame [m]
  Eigen::Matrix3Xf towards_sensor;  ///< per point, unit length: towards those who saw it
};

/// The paper's point cloud map: the selected frames' points in the map frame, averaged per cell of
/// `cell_size` [m]. Frames are read with the selection's stride. Throws std::runtime_error if no frame is
/// left.
MapCloud mapCloudFromFrames(const FrameFolder& folder, const FrameSelection& selection, double cell_size);

/// The same of a model: points spread evenly over the mesh, averaged per cell; the sensor is on the side that
/// the faces' normals point to. Throws std::invalid_argument for an empty mesh.
MapCloud mapCloudFromMesh(const SurfaceMesh& mesh, double cell_size);

/// Points averaged per cell of `cell_size` [m].
Eigen::Matrix3Xf thinned(const Eigen::Matrix3Xf& points, double cell_size);

}  // namespace ttsdf

// The field as an octree: the cells' middles are asked, whatever the map's grid is turned to.

#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "export_ending.h"
#include "export_file.h"
#include "ttsdf_localization/exports/exports.h"

namespace ttsdf {

namespace {

constexpr double kMostCells = 2e8;   // asked one by one
constexpr double kMostKeys = 32767;  // an octree has 2^16 cells a side

void checkResolution(const Eigen::AlignedBox3d& box, double resolution, double voxel,
                     const std::string& path) {
  const auto refuse = [&](const std::string& why, double least, double most) {
    std::ostringstream text;
    text << "octomap '" << path << "': got a resolution of " << resolution << " m" << why << ", wanted "
         << least << " to " << most << " m";
    throw std::invalid_argument(text.str());
  };
  const Eigen::Vector3d extent = box.sizes();
  const double most = std::max(extent.maxCoeff(), voxel);
  const double finest = std::min(voxel, std::cbrt(extent.array().max(voxel).prod() / kMostCells));
  if (!(resolution > 0.0 && std::isfinite(resolution))) refuse("", finest, most);
  if (resolution > most) refuse(", more than the whole map is long", finest, most);
  const double reach = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  if (reach > kMostKeys * resolution) {
    std::ostringstream text;
    text << "octomap '" << path << "': got a resolution of " << resolution << " m for a map that reaches "
         << reach << " m from the origin, wanted at least " << reach / kMostKeys
         << " m: an octree has 32767 cells on each side of the origin";
    throw std::invalid_argument(text.str());
  }
  // Of the map's own voxels there may be as many as there are.
  const double cells = (extent.array() / resolution).ceil().max(1.0).prod();
  if (cells > kMostCells && resolution < 0.99 * voxel) refuse(", more cells than 2 10^8", finest, most);
}

/// Points in a cell per axis, no further apart than the map's voxels.
int samplesPerAxis(double resolution, double voxel) {
  return std::max(1, static_cast<int>(std::ceil(resolution / voxel - 1e-6)));
}

class CellRows {
 public:
  CellRows(const TtSdfMap& map, const octomap::OcTree& tree)
      : field_(makeField(map)),
        resolution_(tree.getResolution()),
        samples_(samplesPerAxis(resolution_, map.geometry.voxel_size)),
        half_(static_cast<float>(0.5 * resolution_ / samples_)) {}

  /// Into `states`: 0 unknown, 1 free, 2 occupied, of `count` cells from `first` (its lower corner) on.
  void ask(const Eigen::Vector3d& first, int count, std::vector<int>& states) {
    states.assign(static_cast<std::size_t>(count), 0);
    const double step = resolution_ / samples_;
    points_.resize(3, static_cast<Eigen::Index>(count) * samples_);
    for (int k = 0; k < samples_; ++k) {
      for (int j = 0; j < samples_; ++j) {
        for (Eigen::Index i = 0; i < points_.cols(); ++i) {
          const Eigen::Vector3d inside((static_cast<double>(i) + 0.5) * step, (j + 0.5) * step,
                                       (k + 0.5) * step);
          points_.col(i) = (first + inside - field_->geometry().origin).cast<float>();
        }
        const FieldSamples found = field_->evaluate(points_);
        for (Eigen::Index i = 0; i < points_.cols(); ++i) {
          if (found.states[static_cast<std::size_t>(i)] != PointState::kValid) continue;
          const float value = found.values[i];
          int& state = states[static_cast<std::size_t>(i / samples_)];
          if (std::abs(value) <= half_) {
            state = 2;
          } else if (value > 0.0F) {
            state = std::max(state, 1);
          }
        }
      }
    }
  }

 private:
  std::shared_ptr<const DistanceField> field_;
  double resolution_;
  int samples_;
  float half_;
  Eigen::Matrix3Xf points_;
};

void fill(const TtSdfMap& map, const Eigen::AlignedBox3d& box, octomap::OcTree& tree) {
  const double resolution = tree.getResolution();
  const Eigen::Array3i low = (box.min() / resolution).array().floor().cast<int>();
  const Eigen::Array3i high = (box.max() / resolution).array().floor().cast<int>();
  const int zero = 32768;  // the key of the cell above the origin
  CellRows rows(map, tree);
  std::vector<int> states;
  for (int k = low.z(); k <= high.z(); ++k) {
    for (int j = low.y(); j <= high.y(); ++j) {
      rows.ask(resolution * Eigen::Vector3d(low.x(), j, k), high.x() - low.x() + 1, states);
      for (int i = low.x(); i <= high.x(); ++i) {
        const int state = states[static_cast<std::size_t>(i - low.x())];
        if (state == 0) continue;
        const octomap::OcTreeKey key(static_cast<octomap::key_type>(i + zero),
                                     static_cast<octomap::key_type>(j + zero),
                                     static_cast<octomap::key_type>(k + zero));
        tree.setNodeValue(key, state == 2 ? tree.getClampingThresMaxLog() : tree.getClampingThresMinLog(),
                          true);
      }
    }
  }
  tree.updateInnerOccupancy();
}

}  // namespace

std::size_t writeOctomap(const TtSdfMap& map, const std::string& path, double resolution) {
  requireEnding("octomap", path, {".bt"});
  const double voxel = map.geometry.voxel_size;
  if (resolution == 0.0) resolution = voxel;
  const Eigen::AlignedBox3d box = boxOf(map.geometry);
  checkResolution(box, resolution, voxel, path);
  octomap::OcTree tree(resolution);
  fill(map, box, tree);
  std::size_t occupied = 0;
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf)
    occupied += tree.isNodeOccupied(*leaf) ? 1 : 0;
  if (occupied == 0) throw std::runtime_error("octomap '" + path + "': the map shows no surface");
  std::ostringstream bytes;
  if (!tree.writeBinary(bytes)) throw std::runtime_error("octomap '" + path + "': cannot be written");
  writeExport(path, bytes.str());
  return occupied;
}

}  // namespace ttsdf

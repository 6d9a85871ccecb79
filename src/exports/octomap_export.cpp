// The field as an octree: the cells' middles are asked, whatever the map's grid is turned to.

#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

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

enum class Cell : std::uint8_t { kUnknown, kInside, kFree, kOccupied };

/// What two samples say together: where the sign changes there is a surface between them, however far off
/// both are.
Cell combined(Cell a, Cell b) {
  const bool surface = (a == Cell::kInside && b == Cell::kFree) || (a == Cell::kFree && b == Cell::kInside);
  return surface ? Cell::kOccupied : std::max(a, b);
}

class CellRows {
 public:
  CellRows(const TtSdfMap& map, const octomap::OcTree& tree)
      : field_(makeField(map)),
        resolution_(tree.getResolution()),
        samples_(samplesPerAxis(resolution_, map.geometry.voxel_size)),
        half_(static_cast<float>(0.5 * resolution_ / samples_)) {}

  /// Into `cells`: `count` of them from `first` (its lower corner) on.
  void ask(const Eigen::Vector3d& first, int count, std::vector<Cell>& cells) {
    cells.assign(static_cast<std::size_t>(count), Cell::kUnknown);
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
          const Cell sample = std::abs(value) <= half_ ? Cell::kOccupied
                              : value > 0.0F           ? Cell::kFree
                                                       : Cell::kInside;
          Cell& cell = cells[static_cast<std::size_t>(i / samples_)];
          cell = combined(cell, sample);
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

/// Cells into a tree, layer by layer from below.
class TreeFiller {
 public:
  TreeFiller(const Eigen::Array3i& low, const Eigen::Array3i& high, octomap::OcTree& tree)
      : low_(low), row_size_(static_cast<std::size_t>(high.x() - low.x() + 1)), tree_(tree) {}

  void add(int j, int k, const std::vector<Cell>& row) {
    if (k != k_) below_ = std::exchange(layer_, {}), k_ = k;
    const std::size_t begin = layer_.size();
    layer_.insert(layer_.end(), row.begin(), row.end());
    for (std::size_t n = begin; n < layer_.size(); ++n) {
      const Eigen::Array3i at(low_.x() + static_cast<int>(n - begin), j, k);
      set(layer_[n], at);
      // A surface in the middle between two cells may be too far from both.
      if (n > begin) close(layer_[n - 1], at - Eigen::Array3i(1, 0, 0), layer_[n], at);
      if (n >= row_size_) close(layer_[n - row_size_], at - Eigen::Array3i(0, 1, 0), layer_[n], at);
      if (!below_.empty()) close(below_[n], at - Eigen::Array3i(0, 0, 1), layer_[n], at);
    }
  }

 private:
  /// Of a free cell and one inside matter the latter becomes occupied.
  void close(Cell& a, const Eigen::Array3i& at_a, Cell& b, const Eigen::Array3i& at_b) {
    if (a == Cell::kInside && b == Cell::kFree) set(a = Cell::kOccupied, at_a);
    if (a == Cell::kFree && b == Cell::kInside) set(b = Cell::kOccupied, at_b);
  }
  void set(Cell cell, const Eigen::Array3i& at) {
    if (cell != Cell::kFree && cell != Cell::kOccupied) return;
    constexpr int kZero = 32768;  // the key of the cell above the origin
    const octomap::OcTreeKey key(static_cast<octomap::key_type>(at.x() + kZero),
                                 static_cast<octomap::key_type>(at.y() + kZero),
                                 static_cast<octomap::key_type>(at.z() + kZero));
    tree_.setNodeValue(
        key, cell == Cell::kOccupied ? tree_.getClampingThresMaxLog() : tree_.getClampingThresMinLog(), true);
  }

  const Eigen::Array3i low_;
  const std::size_t row_size_;
  octomap::OcTree& tree_;
  int k_ = std::numeric_limits<int>::min();
  std::vector<Cell> layer_, below_;
};

void fill(const TtSdfMap& map, const Eigen::AlignedBox3d& box, octomap::OcTree& tree) {
  const double resolution = tree.getResolution();
  const Eigen::Array3i low = (box.min() / resolution).array().floor().cast<int>();
  const Eigen::Array3i high = (box.max() / resolution).array().floor().cast<int>();
  CellRows rows(map, tree);
  TreeFiller filler(low, high, tree);
  std::vector<Cell> cells;
  for (int k = low.z(); k <= high.z(); ++k) {
    for (int j = low.y(); j <= high.y(); ++j) {
      rows.ask(resolution * Eigen::Vector3d(low.x(), j, k), high.x() - low.x() + 1, cells);
      filler.add(j, k, cells);
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

#pragma once
// Which boxes are near a point, of ten thousand: a binary tree over boxes.

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

namespace ttsdf {

class BoxTree {
 public:
  explicit BoxTree(std::vector<Eigen::AlignedBox3d> boxes = {});

  /// Indices of the boxes at most `distance` [m] away from `box`, rising.
  std::vector<std::size_t> within(const Eigen::AlignedBox3d& box, double distance) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    std::size_t begin, end;  ///< of order_
    std::size_t first = 0;   ///< its two children are first and first + 1; 0: a leaf
  };
  void split(std::size_t node);

  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<std::size_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace ttsdf

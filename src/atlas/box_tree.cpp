#include "ttsdf_localization/atlas/box_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace ttsdf {

BoxTree::BoxTree(std::vector<Eigen::AlignedBox3d> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  if (boxes_.empty()) return;
  nodes_.push_back({{}, 0, boxes_.size()});
  for (std::size_t n = 0; n < nodes_.size(); ++n) split(n);
}

void BoxTree::split(std::size_t node) {
  constexpr std::size_t kLeaf = 4;
  Eigen::AlignedBox3d box, centres;
  const std::size_t begin = nodes_[node].begin, end = nodes_[node].end;
  for (std::size_t n = begin; n < end; ++n) {
    box.extend(boxes_[order_[n]]);
    centres.extend(boxes_[order_[n]].center());
  }
  nodes_[node].box = box;
  if (end - begin <= kLeaf) return;
  int axis = 0;
  centres.sizes().maxCoeff(&axis);
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [this](std::size_t n) { return order_.begin() + static_cast<std::ptrdiff_t>(n); };
  std::nth_element(at(begin), at(middle), at(end), [&](std::size_t a, std::size_t b) {
    return boxes_[a].center()[axis] < boxes_[b].center()[axis];
  });
  nodes_[node].first = nodes_.size();
  nodes_.push_back({{}, begin, middle});
  nodes_.push_back({{}, middle, end});
}

std::vector<std::size_t> BoxTree::within(const Eigen::AlignedBox3d& box, double distance) const {
  const auto near = [&](const Eigen::AlignedBox3d& other) {
    return other.squaredExteriorDistance(box) <= distance * distance;
  };
  std::vector<std::size_t> found, waiting;
  if (!nodes_.empty()) waiting.push_back(0);
  while (!waiting.empty()) {
    const Node& node = nodes_[waiting.back()];
    waiting.pop_back();
    if (!near(node.box)) continue;
    if (node.first != 0) {
      waiting.insert(waiting.end(), {node.first, node.first + 1});
      continue;
    }
    for (std::size_t n = node.begin; n < node.end; ++n) {
      if (near(boxes_[order_[n]])) found.push_back(order_[n]);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace ttsdf

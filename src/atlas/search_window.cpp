#include "search_window.h"

#include <utility>

#include "atlas_members.h"

namespace ttsdf {

SearchWindow::SearchWindow(std::shared_ptr<const AtlasField> field, std::size_t maps)
    : field_(std::move(field)), geometry_(field_->geometry()) {
  Eigen::AlignedBox3d box;
  for (std::size_t n = 0; n < maps; ++n) box.extend(boxInAtlas(field_->maps()[n]).bounds());
  box.translate(-geometry_.origin);
  geometry_.T_map_grid = Eigen::Translation3d(box.min());
  geometry_.dims = (box.sizes().array() / geometry_.voxel_size - 1e-6).ceil().cast<int>() + 1;
  setAgreement(field_->agreement());
}

}  // namespace ttsdf

#include "atlas_members.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace ttsdf {

OrientedBox boxInAtlas(const PlacedField& map) {
  const GridGeometry& g = map.field->geometry();
  return {map.T_atlas_map * inMapFrame(g, g.T_map_grid), g.voxel_size * (g.dims - 1).cast<double>().matrix()};
}

std::size_t deepestOf(const std::vector<PlacedField>& maps, const Eigen::Vector3d& p_atlas) {
  std::size_t best = 0;
  double depth = -std::numeric_limits<double>::infinity();
  for (std::size_t n = 0; n < maps.size(); ++n) {
    const double here = boxInAtlas(maps[n]).depth(p_atlas);
    if (here > depth) depth = here, best = n;
  }
  return best;
}

namespace {

void checkPlaced(const std::vector<PlacedField>& maps) {
  if (maps.empty()) throw std::invalid_argument("atlas field: got no maps, wanted at least one");
  for (const PlacedField& map : maps) {
    if (!map.field) throw std::invalid_argument("atlas field: map '" + map.name + "': got no field");
    GridGeometry place = map.field->geometry();
    place.T_map_grid = map.T_atlas_map * place.T_map_grid;
    check(place);
  }
}

/// The box of all maps along the atlas' axes, relative to an origin near it.
GridGeometry coveringGrid(const std::vector<PlacedField>& maps) {
  Eigen::AlignedBox3d all;
  GridGeometry geometry;
  geometry.voxel_size = maps.front().field->geometry().voxel_size;
  for (const PlacedField& map : maps) {
    all.extend(boxInAtlas(map).bounds());
    geometry.voxel_size = std::min(geometry.voxel_size, map.field->geometry().voxel_size);
  }
  geometry.dims = (all.sizes().array() / geometry.voxel_size - 1e-6).ceil().cast<int>() + 1;
  geometry.T_map_grid.translation() = all.min();
  return relativeToOrigin(geometry);
}

}  // namespace

AtlasField::Members::Members(std::vector<PlacedField> placed, const std::vector<OrientedBox>& absent_boxes)
    : maps(std::move(placed)) {
  checkPlaced(maps);
  geometry = coveringGrid(maps);
  for (const PlacedField& map : maps) {
    const OrientedBox box = boxInAtlas(map);
    const Eigen::Isometry3d T_atlas_origin(Eigen::Translation3d(geometry.origin));
    const Eigen::Translation3d to_field(-map.field->geometry().origin);
    Eigen::AlignedBox3d bounds = box.bounds();
    bounds.translate(-geometry.origin);
    const Eigen::Isometry3d T_field_atlas = to_field * map.T_atlas_map.inverse() * T_atlas_origin,
                            T_box_atlas = box.T_atlas_box.inverse() * T_atlas_origin;
    members.push_back({map.field.get(), map.far.get(), T_field_atlas.cast<float>(), T_box_atlas.cast<float>(),
                       box.size.cast<float>(), bounds.cast<float>()});
  }
  const Eigen::Isometry3d T_atlas_origin(Eigen::Translation3d(geometry.origin));
  for (const OrientedBox& box : absent_boxes)
    absent.push_back({(box.T_atlas_box.inverse() * T_atlas_origin).cast<float>(), box.size.cast<float>()});
}

int AtlasField::Members::deepest(const Eigen::Vector3f& p) const {
  int best = -1;
  float depth = -1.0F;
  for (std::size_t m = 0; m < members.size(); ++m) {
    const float here = members[m].depth(p);
    // Written so that NaN is no support.
    if (here >= 0.0F && here > depth) depth = here, best = static_cast<int>(m);
  }
  return best;
}

}  // namespace ttsdf

#pragma once
// Several maps as one field: a scan is registered against all of them at once, each point in the map that
// supports it best. Immutable: other maps mean another field, put into use between two scans.

#include <memory>
#include <string>
#include <vector>

#include "ttsdf_localization/atlas/oriented_box.h"
#include "ttsdf_localization/field/distance_field.h"

namespace ttsdf {

/// A map in memory and where it lies.
struct PlacedField {
  std::string name, map_id;
  Eigen::Isometry3d T_atlas_map = Eigen::Isometry3d::Identity();
  std::shared_ptr<const DistanceField> field;
  std::shared_ptr<const DistanceField> far;  ///< its far field; null if it shows no surface
};

/// Points, values and gradients are of the atlas' frame. A point is answered by a map that knows it; of
/// several, by the one whose box border is furthest from it: there compression errs least, and two maps take
/// turns half-way. Where none knows it, it is unknown if it lies in any map, and outside otherwise.
///
/// The geometry is the box of all maps along the axes of the atlas, with the smallest voxel of the maps. What
/// is known about the maps' errors is that of the worst of them.
///
/// `absent`: boxes of maps that there are, but not here. A point in one of them that no map here knows is
/// answered as being kAbsentDistance from any surface, without a gradient: it pulls at no pose, and no pose
/// explains it. Were it unknown, a pose would be verified on the strength of the half of a scan that lies in
/// the maps at hand.
class AtlasField final : public DistanceField {
 public:
  static constexpr float kAbsentDistance = 1.0F;  ///< [m]

  /// Throws std::invalid_argument: no maps, a null field, a pose that is no rigid motion.
  explicit AtlasField(std::vector<PlacedField> maps, const std::vector<OrientedBox>& absent = {});
  ~AtlasField() override;

  const GridGeometry& geometry() const override;
  using DistanceField::evaluate;
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override;
  std::size_t memoryBytes() const override;
  void warmUp(const KeepGoing& keep_going = {}) const override;
  /// Every point goes to the map that is asked for it first.
  void prepare(const PointSpan& points) const override;

  const std::vector<PlacedField>& maps() const;
  /// The maps' far fields as one: the nearest surface that any map shows whose box holds the point; outside
  /// of all boxes, the nearest box is asked. Null if no map has one.
  std::shared_ptr<const DistanceField> farField() const;

 private:
  class Members;
  class Far;
  std::shared_ptr<const Members> members_;
};

}  // namespace ttsdf

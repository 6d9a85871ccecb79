#include "ttsdf_localization/map/tt_sdf_map.h"

#include <cmath>
#include <sstream>

namespace ttsdf {

namespace {

void checkCores(const TtSdfMap& map) {
  const TensorTrain& train = map.train;
  if (train.first().size() == 0 || (train.dims() != map.geometry.dims).any()) {
    std::ostringstream text;
    text << "map: got a tensor train of ";
    if (train.first().size() == 0) {
      text << "no entries";
    } else {
      text << "extents " << train.dims().transpose();
    }
    text << ", wanted " << map.geometry.dims.transpose();
    throw std::invalid_argument(text.str());
  }
  if (!train.first().allFinite() || !train.middle().allFinite() || !train.last().allFinite()) {
    throw std::invalid_argument("map: got cores with NaN or infinity, wanted finite numbers");
  }
}

void checkMask(const TtSdfMap& map) {
  if (map.mask.empty()) return;
  const int cell = map.mask.cellVoxels();
  const bool cells_fit =
      cell >= 1 && (map.mask.cellDims() == (map.geometry.dims - 1) / std::max(cell, 1) + 1).all();
  if (cells_fit) return;
  std::ostringstream text;
  text << "map: got a support mask of " << map.mask.cellDims().transpose() << " cells of " << cell
       << " voxels, wanted to cover " << map.geometry.dims.transpose() << " voxels";
  throw std::invalid_argument(text.str());
}

void checkDistance(const char* field, double value) {
  if (std::isfinite(value) && value >= 0.0) return;
  std::ostringstream text;
  text << "map: got " << field << " " << value << " m, wanted a finite distance >= 0";
  throw std::invalid_argument(text.str());
}

}  // namespace

const char* name(FieldKind kind) { return kind == FieldKind::kTsdf ? "tsdf" : "sdf"; }

FieldKind fieldKindFromName(const std::string& text) {
  if (text == "sdf") return FieldKind::kSdf;
  if (text == "tsdf") return FieldKind::kTsdf;
  throw std::invalid_argument("field kind: got '" + text + "', wanted sdf or tsdf");
}

void check(const TtSdfMap& map) {
  check(map.geometry);
  checkCores(map);
  checkMask(map);
  checkDistance("truncation", map.truncation);
  checkDistance("clamp_negative", map.clamp_negative);
  checkDistance("clamp_positive", map.clamp_positive);
  check(map.agreement);
}

std::unique_ptr<TtDistanceField> makeField(const TtSdfMap& map, const TtFieldOptions& options) {
  check(map);
  auto field =
      std::make_unique<TtDistanceField>(map.train, relativeToOrigin(map.geometry), map.mask, options);
  field->setAgreement(map.agreement);
  return field;
}

}  // namespace ttsdf

#pragma once
// A compressed map: tensor train + where it sits + what its numbers mean + where it knows anything.

#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "ttsdf_localization/field/frame_agreement.h"
#include "ttsdf_localization/field/grid_geometry.h"
#include "ttsdf_localization/field/support_mask.h"
#include "ttsdf_localization/field/tt_distance_field.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

enum class FieldKind : std::uint8_t { kSdf = 0, kTsdf = 1 };

const char* name(FieldKind kind);                 ///< "sdf" | "tsdf"
FieldKind fieldKindFromName(const std::string&);  ///< throws std::invalid_argument

struct TtSdfMap {
  TensorTrain train;
  GridGeometry geometry;
  SupportMask mask;  ///< empty: everything is supported
  FieldKind kind = FieldKind::kSdf;
  double truncation = 0.0;  ///< fusion's truncation distance [m]
  /// Values were clamped to [-clamp_negative, clamp_positive] [m]; 0: not clamped.
  double clamp_negative = 0.0;
  double clamp_positive = 0.0;
  std::string frame_id = "map";
  FrameAgreement agreement;                     ///< of the frames it was made of, if that was measured
  std::map<std::string, std::string> metadata;  ///< build report and whatever the builder wants to tell
};

/// Invariants: shapes agree, everything is finite, distances not negative. Throws std::invalid_argument.
void check(const TtSdfMap& map);

/// The field that registration asks; its points are relative to its geometry's origin (zero near zero).
std::unique_ptr<TtDistanceField> makeField(const TtSdfMap& map, const TtFieldOptions& options = {});

}  // namespace ttsdf

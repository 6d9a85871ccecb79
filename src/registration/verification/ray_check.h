#pragma once
// The other half of a scan: not only where rays ended, also what they went through.

#include <Eigen/Geometry>

#include "../scan_buffer.h"
#include "ttsdf_localization/field/distance_field.h"

namespace ttsdf {

/// Share of rays from the sensor's origin to the scan's points [0, 1] that the map's matter stands in the way
/// of. A wrong pose whose points all happen to lie on surfaces, such as the other side of a wall, sees
/// through matter; the right one does so only where things were taken away since the map was made. Looks
/// along at most `rays` rays, every 1.5 voxels, up to 2.5 voxels or three standard deviations of the sensor
/// before their ends; unknown space blocks nothing. `far` (may be null) says where no surface is near, so
/// that the map need not be asked there.
double blockedShare(const DistanceField& field, const DistanceField* far, const ScanBuffer& scan,
                    const Eigen::Isometry3d& T_map_sensor, int rays);

}  // namespace ttsdf

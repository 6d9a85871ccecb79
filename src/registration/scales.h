#pragma once
// Lengths of one registration, from the map's voxel size and the scan: an object of 0.3 m and a hall of 60 m
// need other ones than a room.

#include <algorithm>
#include <cmath>

#include "scan_buffer.h"
#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {

struct Scales {
  double voxel = 0.02;
  double tolerance = 0.05;   ///< a point nearer to the surface is an inlier [m]
  double probe = 0.05;       ///< a pose that is so far off is another one [m]
  double widest = 2.0;       ///< kernel scale of the first descent in the far field [m]
  double far_last = 0.15;    ///< of its last [m]
  double tied_above = 0.3;   ///< above this scale rotations are tied to the start's [m]
  double near_first = 0.2;   ///< of the map's own first stage ... [m]
  double near_second = 0.1;  ///< ... and its second [m]
  double last = 0.05;        ///< of the stage on all points [m]
  double least = 0.004;      ///< narrowest kernel there is [m]
  double score = 0.03;       ///< of the score [m]
  double lever = 1.0;        ///< turns radians into metres that the pose moves [m]

  Scales() = default;
  Scales(const RegistrationOptions& o, double voxel_size, double far_spacing, const ScanBuffer& scan) {
    voxel = voxel_size;
    const double radius = std::max(scan.radius(), voxel), range = scan.range();
    // A pixel of a depth camera is good to a hundredth of its range, more or less, and a map to a part of a
    // voxel.
    tolerance = o.inlier_distance > 0.0 ? o.inlier_distance
                                        : std::min(std::max(0.02 * range, 1.25 * voxel), 5.0 * voxel);
    probe = std::max(tolerance, 2.5 * voxel);
    last = o.kernel_scale_end > 0.0 ? o.kernel_scale_end : tolerance;
    least = o.kernel_scale_least > 0.0 ? o.kernel_scale_least : 0.2 * voxel;
    near_second = 2.0 * last;
    near_first = 4.0 * last;
    far_last = std::max(1.9 * far_spacing, near_second);
    widest = std::max(far_last, o.kernel_scale_start > 0.0 ? o.kernel_scale_start : 2.0 * radius);
    tied_above = radius / 3.0;
    score = 0.6 * tolerance;
    lever = std::max(radius, scan.centroid().norm());
  }
};

}  // namespace ttsdf

#pragma once
// How sure a registration is: a covariance that is robust to correlated residuals, and the directions without
// information.

#include <vector>

#include "../solver/linearizer.h"

namespace ttsdf {

/// Share of the information that a direction along flat walls shows by the noise of the map's gradients
/// alone: more where residuals are large.
double gradientNoise(const NormalEquations& equations, double voxel);

/// Cluster-robust ("sandwich") covariance H^-1 B H^-1 of the twist about the scan's centroid, where B sums
/// the outer products of the score of clusters: neighbouring points see the same map and sensor errors, so
/// they must not count as independent. Clusters are cells of `cluster_size` [m] of the map frame. To B comes
/// what no residual shows, because the pose takes it up: whole surfaces that are off, by as much as the
/// residuals of a cluster have in common. The part of the information that noise of the
/// map's gradients would show as well is not counted. Directions with less than `weak_threshold` of the
/// information get `weak_sigma` [m] (rotation: weak_sigma / radius). `equations`: of the scan at the pose,
/// with the same model.
Matrix6d sandwichCovariance(const DistanceField& field, const ScanBuffer& scan,
                            const Eigen::Isometry3d& T_map_sensor, const NormalEquations& equations,
                            const ResidualModel& model, double cluster_size, double weak_threshold,
                            double weak_sigma);

}  // namespace ttsdf

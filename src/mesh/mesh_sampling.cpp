#include "ttsdf_localization/mesh/mesh_sampling.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "../build_steps/parallel.h"
#include "../signed_field/field_grid.h"
#include "mesh_sides.h"
#include "ttsdf_localization/build_steps/extent.h"
#include "ttsdf_localization/signed_field/signed_distance.h"

namespace ttsdf {
namespace {

constexpr float kMaxEdge = 1.5F;       // [voxel], for the search of the nearest triangle
constexpr double kConsistent = 0.9;    // share of the edges that says how a mesh is turned
constexpr double kMostOfVolume = 0.5;  // an outside flood that leaves less of the volume found a hole

MeshSides sidesOf(const SurfaceMesh& mesh, const std::vector<std::uint8_t>& enclosed) {
  const auto inside = static_cast<double>(std::count(enclosed.begin(), enclosed.end(), 1));
  const bool oriented = orientedShare(mesh) >= kConsistent;
  if (oriented && inside < kMostOfVolume * std::abs(enclosedVolume(mesh))) return MeshSides::kOriented;
  return inside > 0.0 ? MeshSides::kEnclosed : MeshSides::kUnsigned;
}

/// Sign by flood; without anything enclosed, no sign at all.
void fillEnclosed(const NearestSurface& nearest, const std::vector<std::uint8_t>& enclosed,
                  const BuildOptions& options, SampledField& field) {
  field.values = DenseTensor(field.geometry.dims);
  field.known.assign(field.values.size(), 1);
  const auto h = static_cast<float>(field.geometry.voxel_size);
  for (std::size_t n = 0; n < field.values.size(); ++n) {
    field.values.data()[n] =
        clampedTo(options, enclosed[n] ? -h * nearest.distance[n] : h * nearest.distance[n]);
  }
}

/// Sign by the faces' direction, as if the mesh had been observed from its front and nothing else.
void fillOriented(const ObservedSurface& surface, const NearestSurface& nearest, const BuildOptions& options,
                  SampledField& field) {
  std::vector<SideReading> nothing(field.geometry.voxelCount());
  SignedDistanceOptions sign_options;
  sign_options.support_distance = options.support_distance;
  sign_options.clamp_negative = options.clamp_negative;
  sign_options.clamp_positive = options.clamp_positive;
  sign_options.threads = options.threads;
  SignedDistance distance =
      signedDistance(std::move(nothing), surface, nearest, field.geometry, sign_options);
  smoothUnknown(distance, field.geometry.voxel_size, options.threads);
  if (options.support_mask)
    field.mask = supportMask(distance.supported, field.geometry.dims, kMaskCellVoxels);
  field.values = std::move(distance.values);
  field.known = std::move(distance.supported);
}

/// Before anything is allocated.
void checkSize(const SurfaceMesh& mesh, double voxel_size, double margin) {
  constexpr double kBytesPerSample = 24.0, kBytesPerPiece = 150.0;
  std::vector<Eigen::Vector3d> points;
  for (Eigen::Index n = 0; n < mesh.vertices.cols(); ++n)
    points.emplace_back(mesh.origin + mesh.vertices.col(n).cast<double>());
  double area = 0.0;
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    const Eigen::Vector3d& a = points[static_cast<std::size_t>(mesh.triangles(0, n))];
    const Eigen::Vector3d ab = points[static_cast<std::size_t>(mesh.triangles(1, n))] - a;
    const Eigen::Vector3d ac = points[static_cast<std::size_t>(mesh.triangles(2, n))] - a;
    area += 0.5 * ab.cross(ac).norm();
  }
  ExtentCost cost;
  cost.bytes_per_sample = kBytesPerSample;
  cost.bytes_besides = kBytesPerPiece * area / (voxel_size * voxel_size);
  const Eigen::Vector3d low = mesh.vertices.rowwise().minCoeff().cast<double>().array() - margin;
  const Eigen::Vector3d high = mesh.vertices.rowwise().maxCoeff().cast<double>().array() + margin;
  try {
    checkExtent(low, high, voxel_size, points, "vertices", "--scale S makes metres of other units", cost);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string("mesh: ") + error.what());
  }
}

}  // namespace

SampledField sampleMesh(const SurfaceMesh& mesh, double voxel_size, const BuildOptions& options,
                        const BuildProgress& progress, MeshSides* sides) {
  check(mesh);
  if (mesh.empty()) throw std::invalid_argument("mesh: got no triangle, wanted at least one");
  if (!std::isfinite(voxel_size) || voxel_size <= 0.0) {
    throw std::invalid_argument("mesh: got a voxel size of " + std::to_string(voxel_size) +
                                " m, wanted a positive one");
  }
  checkSize(mesh, voxel_size, std::max(options.margin, 3.0 * voxel_size));
  const ProgressStep surface_step(progress, "surface");
  SampledField field;
  const Eigen::Matrix3d R_map_grid =
      options.align_axes ? gridRotation(mesh, nullptr) : Eigen::Matrix3d::Identity();
  // Three voxels around the mesh let the flood pass everywhere.
  field.geometry =
      gridAround(mesh.vertices, R_map_grid, voxel_size, std::max(options.margin, 3.0 * voxel_size));
  const SurfaceMesh fine = subdivided(mesh, kMaxEdge * static_cast<float>(voxel_size));
  surface_step.report(0.5);
  ObservedSurface surface = describeSurface(fine, 0);
  toIndexCoordinates(surface, field.geometry);
  field.geometry.T_map_grid.translation() += mesh.origin;

  const ProgressStep distance_step(progress, "distance");
  NearestSurfaceOptions nearest_options;
  nearest_options.threads = options.threads;
  nearest_options.exact_within = exactRange(options, voxel_size);
  nearest_options.report = [&](double share) { distance_step.report(share); };
  const NearestSurface nearest = nearestSurface(surface.mesh, field.geometry.dims, nearest_options);

  const ProgressStep sign_step(progress, "sign");
  const auto enclosed = enclosedSamples(surface.mesh, nearest, field.geometry.dims, options.threads);
  const MeshSides found = sidesOf(surface.mesh, enclosed);
  sign_step.report(0.5);
  if (found == MeshSides::kOriented) {
    fillOriented(surface, nearest, options, field);
  } else {
    fillEnclosed(nearest, enclosed, options, field);
  }
  sign_step.report(1.0);
  if (sides) *sides = found;
  return field;
}

}  // namespace ttsdf

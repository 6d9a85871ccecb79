#pragma once
// Maps of parts of one analytic world, and atlases of them.

#include "../registration/analytic_world.h"
#include "../support/temp_folder.h"
#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/compression/map_writer.h"
#include "ttsdf_localization/compression/tt_svd.h"

namespace ttsdf::test {

/// Two furnished rooms with a wide door between them: 8 x 3 x 2.4 m.
inline double twoRooms(const Eigen::Vector3d& p) {
  const double walls = std::min(p.minCoeff(), (Eigen::Vector3d(8.0, 3.0, 2.4) - p).minCoeff());
  return std::min({walls, boxSdf(p, {0.6, 0.4, 0.4}, {0.6, 0.4, 0.4}),
                   boxSdf(p, {3.9, 0.4, 1.2}, {0.1, 0.4, 1.2}), boxSdf(p, {1.8, 2.75, 0.5}, {0.5, 0.25, 0.5}),
                   boxSdf(p, {6.8, 2.6, 0.6}, {0.4, 0.4, 0.6}), boxSdf(p, {5.0, 2.8, 0.9}, {0.5, 0.2, 0.9}),
                   (p - Eigen::Vector3d(5.6, 0.6, 0.5)).norm() - 0.4});
}

/// A map of the world between two corners, in a frame of its own: T_atlas_map puts it into the world.
inline TtSdfMap partOf(const Sdf& world, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                       const Eigen::Isometry3d& T_atlas_map, double voxel_size = 0.05, int rank = 40) {
  TtSdfMap map;
  map.geometry.voxel_size = voxel_size;
  map.geometry.dims = ((high - low) / voxel_size).array().round().cast<int>() + 1;
  map.geometry.T_map_grid = T_atlas_map.inverse() * Eigen::Translation3d(low);
  TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = rank;
  map.train =
      ttSvd(sampled([&](const Eigen::Vector3d& p) { return world(T_atlas_map * p); }, map.geometry), options)
          .train;
  map.truncation = 0.15;
  return map;
}

inline AtlasMap store(const TtSdfMap& map, const std::string& name, const Eigen::Isometry3d& T_atlas_map,
                      const std::string& folder) {
  const std::string file = name + ".ttsdf";
  const std::vector<std::uint8_t> bytes = serialize(map);
  writeFileAtomically(folder + "/" + file, bytes, kMapFile);
  AtlasMap entry = describeMap(name, file, bytes);
  entry.T_atlas_map = T_atlas_map;
  return entry;
}

/// A wide camera: 140 x 70 degrees about z. With 60 x 45 most views of these bare rooms hold one corner, of
/// which there are many.
inline std::vector<Eigen::Vector3d> wideDirections() {
  std::vector<Eigen::Vector3d> rays;
  for (int v = -17; v <= 17; ++v) {
    for (int u = -35; u <= 35; ++u) {
      const double azimuth = 2.0 * u * M_PI / 180.0, elevation = 2.0 * v * M_PI / 180.0;
      rays.emplace_back(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                        std::cos(elevation) * std::cos(azimuth));
    }
  }
  return rays;
}

inline Eigen::Isometry3d turnedBy(double angle, const Eigen::Vector3d& place) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = place;
  return T;
}

}  // namespace ttsdf::test

// Writes a compressed map of the analytic room of the tests, or of another one that looks nothing like it:
// make_room_map FILE [max_rank] [voxel_size] [room|hall|other] [x], x metres along x. The other room is the
// room with its cupboard elsewhere.

#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>

#include "../support/room.h"
#include "ttsdf_localization/compression/map_writer.h"
#include "ttsdf_localization/compression/tt_svd.h"

namespace {

/// A long hall with two rows of pillars.
struct Hall {
  Eigen::Vector3d size{9.0, 4.0, 3.5};
  double distance(const Eigen::Vector3d& p) const {
    double d = std::min(p.minCoeff(), (size - p).minCoeff());
    for (int n = 0; n < 4; ++n) {
      for (const double y : {1.0, 3.0})
        d = std::min(d, ttsdf::test::boxDistance(p, {1.5 + 2.0 * n, y, 1.75}, {0.2, 0.2, 1.75}));
    }
    return d;
  }
};

/// The room but for the cupboard, which stands elsewhere along its wall.
struct OtherRoom : ttsdf::test::Room {
  double distance(const Eigen::Vector3d& p) const {
    const double walls = std::min(p.minCoeff(), (size - p).minCoeff());
    return std::min({walls, ttsdf::test::boxDistance(p, {0.4, 0.9, 1.0}, {0.4, 0.9, 1.0}),
                     ttsdf::test::boxDistance(p, {4.2, 1.2, 0.4}, {0.8, 0.5, 0.4}),
                     (p - Eigen::Vector3d(4.6, 4.2, 1.4)).norm() - 0.45});
  }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: make_room_map FILE [max_rank] [voxel_size] [room|hall|other] [x]\n";
    return 2;
  }
  try {
    ttsdf::TtSdfMap map;
    const double voxel_size = argc > 3 ? std::atof(argv[3]) : 0.05;
    const std::string scene = argc > 4 ? argv[4] : "room";
    const ttsdf::DenseTensor tensor =
        scene == "hall"    ? ttsdf::test::sampleScene(Hall(), voxel_size, map.geometry)
        : scene == "other" ? ttsdf::test::sampleScene(OtherRoom(), voxel_size, map.geometry)
                           : ttsdf::test::sampleScene(ttsdf::test::Room(), voxel_size, map.geometry);
    if (argc > 5) map.geometry.T_map_grid.translation().x() += std::atof(argv[5]);
    ttsdf::TtSvdOptions options;
    options.max_rank1 = options.max_rank2 = argc > 2 ? std::atoi(argv[2]) : 40;
    map.train = ttsdf::ttSvd(tensor, options).train;
    map.clamp_negative = 0.3;
    map.clamp_positive = 0.6;
    map.truncation = 0.15;
    ttsdf::saveMap(map, argv[1]);
  } catch (const std::exception& error) {
    std::cerr << "make_room_map: " << error.what() << '\n';
    return 1;
  }
  return 0;
}

// Writes a compressed map of the analytic room of the tests: make_room_map FILE [max_rank] [voxel_size].

#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>

#include "../support/room.h"
#include "ttsdf_localization/compression/map_writer.h"
#include "ttsdf_localization/compression/tt_svd.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: make_room_map FILE [max_rank] [voxel_size]\n";
    return 2;
  }
  try {
    ttsdf::TtSdfMap map;
    const double voxel_size = argc > 3 ? std::atof(argv[3]) : 0.05;
    const ttsdf::DenseTensor tensor = ttsdf::test::sampleScene(ttsdf::test::Room(), voxel_size, map.geometry);
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

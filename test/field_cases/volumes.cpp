// Writes the .vdb files of the field cases: volumes FOLDER. A box of 2 x 1.5 x 1 m as a level set.

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string>

namespace {

constexpr double kVoxel = 0.02;  // [m]
constexpr float kBand = 0.06F;

/// Distances in metres; `voxel` and `value_scale` are what the file says of its units.
openvdb::FloatGrid::Ptr box(double voxel, float value_scale) {
  const openvdb::Vec3d half(1.0, 0.75, 0.5);
  auto grid = openvdb::FloatGrid::create(kBand * value_scale);
  auto values = grid->getAccessor();
  for (int i = -54; i <= 54; ++i) {
    for (int j = -42; j <= 42; ++j) {
      for (int k = -29; k <= 29; ++k) {
        const openvdb::Vec3d p = kVoxel * openvdb::Vec3d(i, j, k);
        const openvdb::Vec3d q(std::abs(p[0]) - half[0], std::abs(p[1]) - half[1], std::abs(p[2]) - half[2]);
        const openvdb::Vec3d out(std::max(q[0], 0.0), std::max(q[1], 0.0), std::max(q[2], 0.0));
        const auto d = static_cast<float>(out.length() + std::min(0.0, std::max({q[0], q[1], q[2]})));
        if (std::abs(d) < kBand) values.setValue({i, j, k}, d * value_scale);
      }
    }
  }
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setName("surface");
  return grid;
}

void write(const std::string& path, const openvdb::FloatGrid::Ptr& grid) {
  openvdb::io::File(path).write(openvdb::GridCPtrVec{grid});
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  openvdb::initialize();
  const std::string folder = std::string(argv[1]) + "/";
  write(folder + "identity_xform.vdb", box(1.0, 1.0F / static_cast<float>(kVoxel)));
  write(folder + "mm.vdb", box(1000.0 * kVoxel, 1000.0F));
  const auto stray = box(kVoxel, 1.0F);
  stray->tree().setValue({100000, 0, 0}, 0.01F);
  write(folder + "strayvoxel.vdb", stray);
  // Counts and offsets of a file with a byte turned round are what OpenVDB's own reader falls over.
  write(folder + "whole.vdb", box(kVoxel, 1.0F));
  std::ifstream in(folder + "whole.vdb", std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  for (const int percent : {20, 50, 93}) {
    std::string damaged = bytes;
    char& byte = damaged[bytes.size() * static_cast<std::size_t>(percent) / 100];
    byte = static_cast<char>(byte ^ 0x5a);
    std::ofstream(folder + "vdb_" + std::to_string(percent) + ".vdb", std::ios::binary) << damaged;
  }
  std::ofstream(folder + "vdb_cut.vdb", std::ios::binary) << bytes.substr(0, bytes.size() / 2);
}

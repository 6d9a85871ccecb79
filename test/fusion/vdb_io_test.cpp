// Volumes saved and restored, and grids made by others.

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <sys/resource.h>

#include <csignal>
#include <cstring>

#include "../support/rendered_scene.h"
#include "../support/temp_folder.h"
#include "../support/volume_probe.h"

namespace ttsdf {
namespace {

using testing::camera;
using testing::lookAt;
using testing::render;
using testing::Scene;
using testing::TempFolder;
using testing::thrownMessage;
using testing::worldPosition;
using testing::zeroCrossings;

constexpr float kRadius = 0.5F;
const openvdb::Vec3f kCentre(0.31F, -0.12F, 0.77F);

class VdbIo : public ::testing::Test {
 protected:
  VdbIo() { openvdb::initialize(); }

  std::string writeGrids(const openvdb::GridCPtrVec& grids) {
    const std::string path = folder_.file("foreign.vdb");
    openvdb::io::File file(path);
    file.write(grids);
    file.close();
    return path;
  }
  static Scene sphereScene() {
    return Scene().sphere(Eigen::Vector3d(kCentre.x(), kCentre.y(), kCentre.z()), kRadius);
  }
  static double rmsError(const TsdfVolume& volume) {  // [voxel]
    std::vector<double> errors;
    for (const auto& point : zeroCrossings(volume)) {
      errors.push_back(sphereScene().distance(point) / volume.options().voxel_size);
    }
    EXPECT_GT(errors.size(), 1000U);
    return testing::rms(errors);
  }
  static TsdfVolume fusedRoom() {
    TsdfVolume volume;
    const Scene scene = Scene().room({0, 0, 0}, {3, 3, 2.5}).sphere({1.0, 0.8, 0.5}, 0.3);
    for (const Eigen::Vector3d& eye : {Eigen::Vector3d(2, 2, 1), Eigen::Vector3d(2.2, 1.9, 1.4)}) {
      const auto pose = lookAt(eye, {1.0, 0.8, 0.5});
      volume.integrate(render(scene, camera(), pose), camera(), pose);
    }
    return volume;
  }
  std::string loadError(const std::string& path, const FusionOptions& options = {}) {
    const std::string message =
        thrownMessage<std::runtime_error>([&] { TsdfVolume::fromVdbFile(path, options); });
    EXPECT_NE(message.find(path), std::string::npos) << message;
    return message;
  }

  TempFolder folder_;
};

TEST_F(VdbIo, SavedVolumeIsRestoredExactly) {
  const TsdfVolume volume = fusedRoom();
  const std::string path = folder_.file("volume.vdb");
  volume.saveVdb(path);
  FusionOptions other;
  other.voxel_size = 0.05, other.truncation = 0.15, other.max_depth = 7.0;
  const TsdfVolume restored = TsdfVolume::fromVdbFile(path, other);
  EXPECT_TRUE(testing::sameVolumes(volume, restored));
  EXPECT_EQ(restored.options().voxel_size, volume.options().voxel_size);
  EXPECT_EQ(restored.options().truncation, volume.options().truncation);
  EXPECT_EQ(restored.options().max_depth, 7.0);
  EXPECT_EQ(restored.frameCount(), 2U);
  EXPECT_EQ(restored.grids().tsdf->background(), volume.grids().tsdf->background());

  // Fusion goes on as if nothing had happened.
  TsdfVolume a = fusedRoom(), b = TsdfVolume::fromVdbFile(path, {});
  const Scene scene = Scene().room({0, 0, 0}, {3, 3, 2.5});
  const auto pose = lookAt({1.5, 2.5, 1.0}, {1.0, 0.8, 0.5});
  a.integrate(render(scene, camera(), pose), camera(), pose);
  b.integrate(render(scene, camera(), pose), camera(), pose);
  EXPECT_TRUE(testing::sameVolumes(a, b));
  b.saveVdb(path);
  EXPECT_EQ(TsdfVolume::fromVdbFile(path, {}).frameCount(), 3U);
}

TEST_F(VdbIo, AFullDiskIsAnErrorAndLeavesTheOldFile) {
  const std::string path = folder_.file("volume.vdb");
  fusedRoom().saveVdb(path);
  const std::string before = testing::fileContent(path);
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  for (const rlim_t bytes : {3000, 20000, 44000, 60000}) {
    const rlimit full{bytes, limit.rlim_max};
    setrlimit(RLIMIT_FSIZE, &full);
    try {
      fusedRoom().saveVdb(path);
      ADD_FAILURE() << bytes;
    } catch (const std::runtime_error& error) {
      EXPECT_LT(std::strlen(error.what()), 400U);  // OpenVDB's own text may hold what it took for a length
    }
  }
  setrlimit(RLIMIT_FSIZE, &limit);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(testing::fileContent(path), before);
  // Nor does it replace what is no .vdb file.
  EXPECT_THROW(fusedRoom().saveVdb(folder_.write("notes.txt", "do not lose me")), std::runtime_error);
}

TEST_F(VdbIo, EmptyVolumeIsRestoredToo) {
  const std::string path = folder_.file("empty.vdb");
  TsdfVolume().saveVdb(path);
  const TsdfVolume restored = TsdfVolume::fromVdbFile(path, {});
  EXPECT_TRUE(restored.empty());
  EXPECT_EQ(restored.frameCount(), 0U);
}

TEST_F(VdbIo, SavedGridsHaveTheirNamesAndTransform) {
  const std::string path = folder_.file("volume.vdb");
  fusedRoom().saveVdb(path);
  openvdb::io::File file(path);
  file.open(false);
  for (const char* name : {"tsdf", "weight", "free"}) {
    ASSERT_TRUE(file.hasGrid(name)) << name;
    const auto grid = file.readGrid(name);
    EXPECT_EQ(grid->indexToWorld(openvdb::Coord(10, -20, 30)), openvdb::Vec3d(0.2, -0.4, 0.6)) << name;
  }
}

TEST_F(VdbIo, LevelSetOnTheSameLatticeKeepsItsValues) {
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(kRadius, kCentre, 0.02F, 3.0F);
  const TsdfVolume volume = TsdfVolume::fromVdbFile(writeGrids({sphere}), {});
  const auto accessor = sphere->getConstAccessor();
  std::size_t count = 0;
  for (auto voxel = volume.grids().tsdf->cbeginValueOn(); voxel; ++voxel, ++count) {
    ASSERT_EQ(*voxel, accessor.getValue(voxel.getCoord()));
  }
  EXPECT_GT(count, 10000U);
  EXPECT_LE(rmsError(volume), 0.05);
}

TEST_F(VdbIo, LevelSetKnowsInsideAndOutside) {
  for (const float foreign_voxel : {0.02F, 0.013F, 0.03F}) {
    const auto sphere =
        openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(kRadius, kCentre, foreign_voxel, 3.0F);
    const TsdfVolume volume = TsdfVolume::fromVdbFile(writeGrids({sphere}), {});
    EXPECT_LE(rmsError(volume), 0.1) << foreign_voxel;
    const VoxelReader reader(volume.grids());
    const double truncation = volume.options().truncation;
    EXPECT_EQ(truncation, 0.06);
    for (int x = -20; x <= 50; ++x) {
      for (int y = -40; y <= 30; ++y) {
        for (int z = 5; z <= 70; ++z) {
          const openvdb::Coord ijk(x, y, z);
          const double distance = sphereScene().distance(worldPosition(volume, ijk));
          const VoxelState state = reader.state(ijk);
          const double clear = std::abs(distance) - truncation;  // half a voxel for the rebuilt band's ends
          const VoxelState beyond = distance < 0.0 ? VoxelState::kInterior : VoxelState::kFree;
          ASSERT_TRUE(state == VoxelState::kBand ? clear < 0.01 : clear > -0.01 && state == beyond) << ijk;
          if (state != VoxelState::kBand) continue;
          ASSERT_NEAR(reader.distance(ijk), distance, std::abs(distance) < 0.02 ? 0.001 : 0.01) << ijk;
        }
      }
    }
  }
}

TEST_F(VdbIo, LevelSetUnderAnyLinearTransform) {
  // The sphere's samples at (i + 1/2) h, turned about an axis: the transform says where they are.
  auto sphere =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(kRadius, openvdb::Vec3f(0.0F), 0.02F, 3.0F);
  const auto transform = openvdb::math::Transform::createLinearTransform(0.02);
  transform->postTranslate(openvdb::Vec3d(0.01));
  transform->postRotate(0.4, openvdb::math::Y_AXIS);
  transform->postTranslate(openvdb::Vec3d(kCentre));
  sphere->setTransform(transform);
  const TsdfVolume volume = TsdfVolume::fromVdbFile(writeGrids({sphere}), {});
  // The grid's own centre is its index origin.
  const openvdb::Vec3d centre = sphere->indexToWorld(openvdb::Vec3d(0.0));
  const Scene scene = Scene().sphere({centre.x(), centre.y(), centre.z()}, kRadius);
  std::vector<double> errors;
  for (const auto& point : zeroCrossings(volume)) errors.push_back(scene.distance(point) / 0.02);
  ASSERT_GT(errors.size(), 1000U);
  EXPECT_LE(testing::rms(errors), 0.1);
}

TEST_F(VdbIo, OpenShellOfOthersStaysOpen) {
  // A fused half sphere without weights and free space, as other fusion programs write it, on a finer
  // lattice.
  FusionOptions fine;
  fine.voxel_size = 0.013, fine.truncation = 0.05, fine.carve = false;
  TsdfVolume fused(fine);
  const Eigen::Vector3d centre(kCentre.x(), kCentre.y(), kCentre.z());
  const auto pose = lookAt(centre + Eigen::Vector3d(1.5, 0.2, 0.1), centre);
  fused.integrate(render(sphereScene(), camera(640, 480), pose), camera(640, 480), pose);
  const auto grid = fused.grids().tsdf->deepCopy();
  grid->setName("D(x): signed distance grid");

  const TsdfVolume volume = TsdfVolume::fromVdbFile(writeGrids({grid}), {});
  EXPECT_FLOAT_EQ(static_cast<float>(volume.options().truncation), 0.05F);  // no wider than the file's band
  EXPECT_LE(rmsError(volume), 0.1);
  const VoxelReader reader(volume.grids());
  const openvdb::Coord middle = openvdb::Coord::round(openvdb::Vec3d(kCentre) / 0.02);
  EXPECT_EQ(reader.state(middle), VoxelState::kUnknown);
  EXPECT_EQ(reader.state(middle.offsetBy(-40, 0, 0)), VoxelState::kUnknown);
  EXPECT_EQ(reader.state(middle.offsetBy(40, 0, 0)), VoxelState::kUnknown);

  FusionOptions coarse;
  coarse.voxel_size = 0.1, coarse.truncation = 0.3;
  EXPECT_NE(loadError(folder_.file("foreign.vdb"), coarse).find("band"), std::string::npos);
}

TEST_F(VdbIo, CarvedShellOfOthersKeepsItsFreeSpace) {
  // Free space of others: active voxels at +truncation.
  FusionOptions options;
  TsdfVolume fused(options);
  const auto pose = Eigen::Isometry3d::Identity();
  fused.integrate(render(Scene().plane({0, 0, -1}, -1.0), camera(), pose), camera(), pose);
  const auto grid = fused.grids().tsdf->deepCopy();
  grid->fill(openvdb::CoordBBox({-5, -5, 20}, {5, 5, 44}), grid->background(), true);
  const TsdfVolume volume = TsdfVolume::fromVdbFile(writeGrids({grid}), options);
  const VoxelReader reader(volume.grids());
  EXPECT_EQ(reader.state({0, 0, 30}), VoxelState::kFree);
  EXPECT_EQ(reader.state({0, 0, 50}), VoxelState::kBand);
  EXPECT_NEAR(reader.distance({0, 0, 49}), 0.02, 1e-4);
  EXPECT_EQ(reader.state({0, 0, 10}), VoxelState::kUnknown);
  EXPECT_EQ(reader.state({0, 0, 60}), VoxelState::kUnknown);
}

TEST_F(VdbIo, OfSeveralGridsTheNamedOneIsTakenAndNoneIsGuessed) {
  auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(kRadius, kCentre, 0.02F, 3.0F);
  auto other =
      openvdb::tools::createLevelSetSphere<openvdb::DoubleGrid>(0.3F, openvdb::Vec3f(2.0F), 0.02F, 3.0F);
  auto numbers = openvdb::Int32Grid::create(3);
  sphere->setName("ls_sphere"), other->setName("a_ball"), numbers->setName("ids");
  const std::string several = writeGrids({other, numbers, sphere});
  const std::string message = loadError(several);
  for (const char* part :
       {"--grid NAME", "'a_ball' (Tree_double", "'ls_sphere' (Tree_float", "'ids' (Tree_int32"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
  VdbImport named;
  std::string note;
  named.grid = "ls_sphere", named.note = &note;
  EXPECT_LE(rmsError(TsdfVolume::fromVdbFile(several, {}, named)), 0.05);
  named.grid = "a_ball";
  for (const auto& point : zeroCrossings(TsdfVolume::fromVdbFile(several, {}, named)))
    ASSERT_NEAR((point - Eigen::Vector3d::Constant(2.0)).norm(), 0.3, 0.004);
  for (const char* wrong : {"ids", "absent"}) {
    named.grid = wrong;
    const std::string refused =
        thrownMessage<std::runtime_error>([&] { TsdfVolume::fromVdbFile(several, {}, named); });
    EXPECT_NE(refused.find("'ls_sphere'"), std::string::npos) << refused;
  }
  // One that is meant among others: it is taken, and said.
  other->setGridClass(openvdb::GRID_FOG_VOLUME);
  VdbImport unnamed;
  unnamed.note = &note;
  EXPECT_LE(rmsError(TsdfVolume::fromVdbFile(writeGrids({other, numbers, sphere}), {}, unnamed)), 0.05);
  EXPECT_NE(note.find("'a_ball'"), std::string::npos) << note;
}

TEST_F(VdbIo, OtherUnitsFogAndStrayVoxelsAreNamed) {
  const auto millimetres = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      1000.0F * kRadius, 1000.0F * kCentre, 20.0F, 3.0F);
  const std::string path = writeGrids({millimetres});
  EXPECT_NE(loadError(path).find("--scale"), std::string::npos);
  VdbImport scaled;
  scaled.scale = 0.001;
  EXPECT_LE(rmsError(TsdfVolume::fromVdbFile(path, {}, scaled)), 0.1);

  auto fog = openvdb::FloatGrid::create(0.0F);
  fog->setTransform(openvdb::math::Transform::createLinearTransform(0.02));
  fog->fill(openvdb::CoordBBox({0, 0, 0}, {20, 20, 20}), 1.0F, true);
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  EXPECT_NE(loadError(writeGrids({fog})).find("wanted"), std::string::npos);

  const auto stray = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(kRadius, kCentre, 0.02F, 3.0F);
  stray->tree().setValueOn({2000000, 0, 0}, 0.01F);
  EXPECT_NE(loadError(writeGrids({stray})).find("1 of"), std::string::npos);

  // Far from zero (UTM): the same surface there.
  const auto far = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(kRadius, kCentre, 0.02F, 3.0F);
  far->transform().postTranslate(openvdb::Vec3d(356789.0, 5412345.0, 100.0));
  const TsdfVolume volume = TsdfVolume::fromVdbFile(writeGrids({far}), {});
  const Eigen::Vector3d there(356789.0, 5412345.0, 100.0), moved = volume.origin() - there;
  double worst = 0.0;
  for (const auto& point : zeroCrossings(volume))
    worst = std::max(worst, std::abs(sphereScene().distance(point + moved)));
  EXPECT_LT(worst, 0.004);
}

TEST_F(VdbIo, BrokenFilesAreErrorsThatNameTheFile) {
  loadError(folder_.file("missing.vdb"));
  loadError(folder_.path());
  loadError(folder_.write("empty.vdb", ""));
  loadError(folder_.write("text.vdb", "this is no VDB file at all, but long enough to look at\n"));
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(kRadius, kCentre, 0.02F, 3.0F);
  const std::string content = testing::fileContent(writeGrids({sphere}));
  for (const double share : {0.01, 0.1, 0.5, 0.9, 0.999}) {
    const auto length = static_cast<std::size_t>(share * static_cast<double>(content.size()));
    loadError(folder_.write("cut.vdb", content.substr(0, length)));
  }
  FusionOptions bad;
  bad.voxel_size = -1.0;
  EXPECT_THROW(TsdfVolume::fromVdbFile(folder_.file("foreign.vdb"), bad), std::invalid_argument);
  EXPECT_THROW(TsdfVolume().saveVdb(folder_.file("no/such/folder.vdb")), std::runtime_error);
}

TEST_F(VdbIo, GridsWithoutASurfaceAreErrors) {
  loadError(writeGrids({}));
  loadError(writeGrids({openvdb::Vec3SGrid::create()}));
  loadError(writeGrids({openvdb::FloatGrid::create(0.06F)}));
  auto grid = openvdb::FloatGrid::create(0.06F);
  grid->tree().setValue({0, 0, 0}, 0.01F);
  loadError(writeGrids({grid}));  // unsigned
  grid->tree().setValue({0, 0, 1}, std::nanf(""));
  EXPECT_NE(loadError(writeGrids({grid})).find("NaN"), std::string::npos);
  loadError(
      writeGrids({openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(kRadius, kCentre, 0.02F, 3.0F)}),
      [] {
        FusionOptions coarse;
        coarse.voxel_size = 5.0, coarse.truncation = 15.0;
        return coarse;
      }());
}

}  // namespace
}  // namespace ttsdf

#include "ttsdf_localization/mesh/mesh_sampling.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "../support/analytic_observation.h"

namespace ttsdf {
namespace {

/// Twelve triangles, outwards.
SurfaceMesh boxMesh(const Eigen::Vector3f& half) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 8);
  for (int n = 0; n < 8; ++n) {
    mesh.vertices.col(n) = half.cwiseProduct(Eigen::Vector3f(n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1));
  }
  mesh.triangles.resize(3, 12);
  mesh.triangles << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,                //
      3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  return mesh;
}

SurfaceMesh turnedAround(SurfaceMesh mesh) {
  mesh.triangles.row(1).swap(mesh.triangles.row(2));
  return mesh;
}

SurfaceMesh joined(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, a.vertices.cols() + b.vertices.cols());
  mesh.vertices << a.vertices, b.vertices;
  mesh.triangles.resize(3, a.triangles.cols() + b.triangles.cols());
  mesh.triangles << a.triangles, (b.triangles.array() + static_cast<int>(a.vertices.cols())).matrix();
  return mesh;
}

BuildOptions unclamped() {
  BuildOptions options;
  options.clamp_negative = options.clamp_positive = 0.0;
  options.align_axes = false;
  return options;
}

template <class Function>
void forEachSample(const SampledField& field, const Function& fn) {
  const Dims& dims = field.geometry.dims;
  std::size_t n = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++n) fn(n, field.geometry.samplePosition(Eigen::Vector3d(i, j, k)));
    }
  }
}

const Eigen::Vector3f kHalf(0.31F, 0.22F, 0.17F);

double boxTruth(const Eigen::Vector3d& p) { return testing::boxDistance(p, kHalf.cast<double>()); }

void expectBox(const SurfaceMesh& mesh, MeshSides expected) {
  MeshSides sides{};
  const SampledField field = sampleMesh(mesh, 0.02, unclamped(), {}, &sides);
  EXPECT_EQ(sides, expected);
  double largest = 0.0;
  forEachSample(field, [&](std::size_t n, const Eigen::Vector3d& p) {
    const double truth = expected == MeshSides::kUnsigned ? std::abs(boxTruth(p)) : boxTruth(p);
    largest = std::max(largest, std::abs(field.values.data()[n] - truth));
  });
  EXPECT_LT(largest, 0.02 * 0.02);
}

TEST(SampleMesh, IsExactForAClosedBoxWhateverWayItIsTurned) {
  expectBox(boxMesh(kHalf), MeshSides::kEnclosed);
  expectBox(turnedAround(boxMesh(kHalf)), MeshSides::kEnclosed);
}

TEST(SampleMesh, TakesSoupsAndDoubledFaces) {
  SurfaceMesh soup;
  const SurfaceMesh box = boxMesh(kHalf);
  soup.vertices.resize(3, 36);
  soup.triangles.resize(3, 12);
  for (int t = 0; t < 12; ++t) {
    for (int c = 0; c < 3; ++c) soup.vertices.col(3 * t + c) = box.vertices.col(box.triangles(c, t));
    soup.triangles.col(t) =
        t % 2 ? Eigen::Vector3i(3 * t, 3 * t + 1, 3 * t + 2) : Eigen::Vector3i(3 * t, 3 * t + 2, 3 * t + 1);
  }
  expectBox(soup, MeshSides::kEnclosed);
  SurfaceMesh doubled = joined(box, turnedAround(box));
  doubled.triangles = doubled.triangles.unaryExpr([](int n) { return n % 8; }).eval();
  expectBox(doubled, MeshSides::kEnclosed);
}

TEST(SampleMesh, GoesByTheFacesDirectionWhereAHoleLetsTheOutsideIn) {
  MeshSides sides{};
  // An open, consistently turned ball: latitude and longitude without the cap at the south pole.
  SurfaceMesh ball;
  constexpr int kRings = 40, kSectors = 60;
  ball.vertices.resize(3, kRings * kSectors);
  ball.triangles.resize(3, 2 * (kRings - 1) * kSectors);
  Eigen::Index t = 0;
  for (int r = 0; r < kRings; ++r) {
    for (int s = 0; s < kSectors; ++s) {
      const double polar = 0.02 + 2.7 * r / (kRings - 1), azimuth = 2.0 * M_PI * s / kSectors;
      ball.vertices.col(r * kSectors + s) =
          0.4F * Eigen::Vector3d(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                                 std::cos(polar))
                     .cast<float>();
      if (r + 1 == kRings) continue;
      const int a = r * kSectors + s, b = r * kSectors + (s + 1) % kSectors;
      ball.triangles.col(t++) = Eigen::Vector3i(a, a + kSectors, b);
      ball.triangles.col(t++) = Eigen::Vector3i(b, a + kSectors, b + kSectors);
    }
  }
  BuildOptions options = unclamped();
  const SampledField field = sampleMesh(ball, 0.02, options, {}, &sides);
  EXPECT_EQ(sides, MeshSides::kOriented);
  int wrong = 0, checked = 0;
  forEachSample(field, [&](std::size_t n, const Eigen::Vector3d& p) {
    const double truth = p.norm() - 0.4;
    if (p.z() < -0.2 || std::abs(truth) > 0.15 || std::abs(truth) < 0.002)
      return;  // the hole; the facets' sagitta
    ++checked;
    if (truth * field.values.data()[n] < 0.0) ++wrong;
    EXPECT_NEAR(field.values.data()[n], truth, 0.003);
    EXPECT_TRUE(field.known[n]);
  });
  EXPECT_GT(checked, 10000);
  EXPECT_EQ(wrong, 0);
  // Beside the hole nothing is known of the ball's wall.
  const Eigen::Vector3d index = field.geometry.toIndex({0.0, 0.0, -0.4});
  EXPECT_FALSE(field.mask.atVoxel(static_cast<int>(std::lround(index.x())),
                                  static_cast<int>(std::lround(index.y())),
                                  static_cast<int>(std::lround(index.z()))));
}

TEST(SampleMesh, IsPositiveOnBothSidesOfASheetTurnedAnyhow) {
  SurfaceMesh sheet;
  sheet.vertices.resize(3, 6);
  sheet.vertices << 0, 1, 1, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0.011F, 0.011F, 0.011F, 0.011F, 0.011F, 0.011F;
  sheet.triangles.resize(3, 2);
  sheet.triangles << 0, 3, 1, 5, 2, 4;
  MeshSides sides{};
  const SampledField field = sampleMesh(sheet, 0.05, unclamped(), {}, &sides);
  EXPECT_EQ(sides, MeshSides::kUnsigned);
  forEachSample(field, [&](std::size_t n, const Eigen::Vector3d& p) {
    const Eigen::Vector3d nearest(std::clamp(p.x(), 0.0, 1.0), std::clamp(p.y(), 0.0, 1.0), 0.011);
    EXPECT_NEAR(field.values.data()[n], (p - nearest).norm(), 2e-3);
  });
}

TEST(SampleMesh, TurnsItsGridAndClamps) {
  SurfaceMesh box = boxMesh(kHalf);
  const Eigen::Matrix3d R =
      (Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  box.vertices = R.cast<float>() * box.vertices;
  BuildOptions options;
  options.clamp_negative = 0.05;
  options.clamp_positive = 0.1;
  const SampledField field = sampleMesh(box, 0.02, options);
  EXPECT_LT(Eigen::AngleAxisd(field.geometry.T_map_grid.linear().transpose() * R).angle(), 1e-3);
  forEachSample(field, [&](std::size_t n, const Eigen::Vector3d& p) {
    ASSERT_NEAR(field.values.data()[n], std::clamp(boxTruth(R.transpose() * p), -0.05, 0.1), 0.02 * 0.02);
  });
}

TEST(SampleMesh, RefusesNonsense) {
  EXPECT_THROW(sampleMesh({}, 0.02, unclamped()), std::invalid_argument);
  EXPECT_THROW(sampleMesh(boxMesh(kHalf), 0.0, unclamped()), std::invalid_argument);
  EXPECT_THROW(sampleMesh(boxMesh(1000.0F * kHalf), 0.02, unclamped()), std::invalid_argument);
  SurfaceMesh broken = boxMesh(kHalf);
  broken.triangles(0, 0) = 8;
  EXPECT_THROW(sampleMesh(broken, 0.02, unclamped()), std::invalid_argument);
  broken = boxMesh(kHalf);
  broken.vertices(0, 0) = std::nanf("");
  EXPECT_THROW(sampleMesh(broken, 0.02, unclamped()), std::invalid_argument);
}

TEST(SampleMesh, CanBeCancelled) {
  int reports = 0;
  EXPECT_THROW(sampleMesh(boxMesh(kHalf), 0.02, unclamped(),
                          [&](const std::string&, double) { return ++reports < 4; }),
               std::runtime_error);
  EXPECT_EQ(reports, 4);
}

/// Models of users: closed, with holes, soups of sheets. Needs the folder of models in TTSDF_TEST_DATA.
TEST(SampleMesh, SamplesRealModels) {
  const char* data = std::getenv("TTSDF_TEST_DATA");
  if (!data) GTEST_SKIP() << "TTSDF_TEST_DATA is not set";
  struct Model {
    std::string name;
    MeshSides sides;
  };
  for (const auto& model :
       {Model{"armadillo.off", MeshSides::kEnclosed}, Model{"stanford-bunny.obj", MeshSides::kOriented},
        Model{"chair_0001.off", MeshSides::kEnclosed}, Model{"chair_0002.off", MeshSides::kEnclosed}}) {
    const std::string path = std::string(data) + "/meshes/" + model.name;
    if (!std::ifstream(path)) GTEST_SKIP() << path << " is not there";
    SurfaceMesh mesh = readMesh(path);
    const float size = (mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff()).maxCoeff();
    mesh.vertices /= size;
    MeshSides sides{};
    const SampledField field = sampleMesh(mesh, 0.01, unclamped(), {}, &sides);
    EXPECT_EQ(sides, model.sides) << model.name;
    // The field vanishes on the mesh.
    double sum = 0.0;
    int count = 0;
    for (Eigen::Index n = 0; n < mesh.vertices.cols(); n += 7) {
      const Eigen::Array3i index =
          (field.geometry.toIndex(mesh.vertices.col(n).cast<double>()).array() + 0.5).floor().cast<int>();
      const Eigen::Vector3d sample = field.geometry.samplePosition(index.cast<double>().matrix());
      const double value = field.values(index[0], index[1], index[2]);
      EXPECT_LE(std::abs(value), (sample - mesh.vertices.col(n).cast<double>()).norm() + 1e-4) << model.name;
      sum += value;
      ++count;
    }
    EXPECT_LT(std::abs(sum / count), 0.005) << model.name;
  }
}

class MeshFiles : public ::testing::Test {
 protected:
  std::string path(const std::string& name) {
    files_.push_back(::testing::TempDir() + "ttsdf_mesh_" + std::to_string(::getpid()) + "_" + name);
    return files_.back();
  }
  std::string write(const std::string& name, const std::string& content) {
    const std::string file = path(name);
    std::ofstream(file, std::ios::binary) << content;
    return file;
  }
  void TearDown() override {
    for (const auto& file : files_) std::remove(file.c_str());
  }

 private:
  std::vector<std::string> files_;
};

TEST_F(MeshFiles, ComeBackAsTheyWereWritten) {
  const SurfaceMesh box = boxMesh(kHalf);
  const std::string file = path("box.ply");
  writePly(box, file);
  const SurfaceMesh again = readMesh(file, 2.0);
  EXPECT_EQ(again.vertices.cols(), 8);
  EXPECT_EQ(again.triangles.cols(), 12);
  EXPECT_TRUE(again.vertices.rowwise().maxCoeff().isApprox(2.0F * kHalf));
}

TEST_F(MeshFiles, AreReadWithAnyLineEndPolygonsAndGluedHeaders) {
  const std::string body = "0 0 0\r\n1 0 0\r\n0 1 0\r\n0 0 1\r\n1 1 0\r\n4 0 1 4 2\r\n3 0 2 3\r\n";
  for (const std::string header :
       {"OFF\r\n5 2 0\r\n", "OFF5 2 0\r\n", "OFF\r\n# made by hand\r\n5 2 0\r\n"}) {
    const SurfaceMesh mesh = readMesh(write("m.off", header + body));
    EXPECT_EQ(mesh.triangles.cols(), 3) << header;
    EXPECT_EQ(mesh.vertices.cols(), 5) << header;
  }
  const SurfaceMesh soup =
      readMesh(write("s.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 4 6 5\n"));
  EXPECT_EQ(soup.triangles.cols(), 2);
  EXPECT_EQ(soup.vertices.cols(), 4);
}

TEST_F(MeshFiles, ThatAreBrokenAreRefusedByName) {
  const std::vector<std::pair<std::string, std::string>> broken{
      {"empty.off", ""},
      {"garbage.off", "no mesh at all, whatever its name says\n"},
      {"nan.off", "OFF\n3 1 0\n0 0 0\n1 0 0\nnan 0 0\n3 0 1 2\n"},
      {"huge.off", "OFF\n999999999 1 0\n0 0 0\n1 0 0\n"},
      {"huge.ply",
       "ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\nproperty float y\nproperty "
       "float z\n"
       "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n"},
      {"points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"},
  };
  for (const auto& [name, content] : broken) {
    const std::string file = write(name, content);
    try {
      readMesh(file);
      ADD_FAILURE() << name << " was read";
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(readMesh("/nowhere/mesh.ply"), std::runtime_error);
  EXPECT_THROW(readMesh(write("box.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), 0.0),
               std::invalid_argument);
  EXPECT_THROW(writePly(boxMesh(kHalf), "/nowhere/mesh.ply"), std::runtime_error);
  EXPECT_THROW(writePly({}, path("none.ply")), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf

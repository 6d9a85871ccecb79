#include "ros/builder/map_build_request.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

namespace ttsdf {
namespace {

using Request = ttsdf_localization::BuildMap::Request;

TEST(BuildOptionsOf, EmptyRequestKeepsTheDefaults) {
  BuildOptions defaults;
  defaults.max_rank = "17";
  defaults.encoding = "float16";
  defaults.tolerance = 0.01;
  const BuildOptions options = buildOptionsOf(Request(), defaults);
  for (const auto& row : buildOptionTable().rows())
    EXPECT_EQ(row.get(options), row.get(defaults)) << row.name;
}

TEST(BuildOptionsOf, EveryFieldOverrides) {
  Request request;
  request.field = "tsdf";
  request.max_rank = "12,34";
  request.tolerance = 0.25;
  request.encoding = "float32";
  request.target_bytes = 100000;
  request.options = {"margin=0.5", "align_axes=false", "max_rank=9"};
  const BuildOptions options = buildOptionsOf(request, BuildOptions());
  EXPECT_EQ(options.field, "tsdf");
  EXPECT_EQ(options.max_rank, "9") << "named options come last";
  EXPECT_EQ(options.tolerance, 0.25);
  EXPECT_EQ(options.encoding, "float32");
  EXPECT_EQ(options.target_bytes, 100000);
  EXPECT_EQ(options.margin, 0.5);
  EXPECT_FALSE(options.align_axes);
}

std::string errorOf(const Request& request) {
  try {
    buildOptionsOf(request, BuildOptions());
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(BuildOptionsOf, TakesOneTargetAtATime) {
  Request request;
  request.target_surface_error = 0.008;
  EXPECT_EQ(buildOptionsOf(request, BuildOptions()).target_surface_error, 0.008);
  request.target_bytes = 100000;
  EXPECT_NE(errorOf(request).find("target"), std::string::npos) << errorOf(request);
}

TEST(BuildOptionsOf, NamesABadValue) {
  Request request;
  request.field = "udf";
  EXPECT_NE(errorOf(request).find("udf"), std::string::npos);
  request = Request();
  request.tolerance = -1.0;
  EXPECT_NE(errorOf(request).find("tolerance"), std::string::npos);
  request = Request();
  request.target_bytes = 3000000000U;
  EXPECT_NE(errorOf(request).find("3000000000"), std::string::npos);
  request = Request();
  request.options = {"=1"};
  EXPECT_FALSE(errorOf(request).empty());
}

TEST(SampleFile, RefusesAnUnknownKindOfFileAndABadScale) {
  const auto build = [](const std::string& path, double scale) { sampleFile(path, scale, {}, {}, {}); };
  EXPECT_THROW(build("/tmp/picture.jpg", 0.0), std::invalid_argument);
  EXPECT_THROW(build("/tmp/no_ending", 0.0), std::invalid_argument);
  EXPECT_THROW(build("/tmp/mesh.ply", -1.0), std::invalid_argument);
  EXPECT_THROW(build("/tmp/there/is/none.vdb", 0.0), std::runtime_error);
}

TEST(SampleFile, TurnsAMeshIntoMetres) {
  const std::string path = testing::TempDir() + "ttsdf_tetrahedron.off";
  std::ofstream(path) << "OFF\n4 4 0\n0 0 0\n100 0 0\n0 100 0\n0 0 100\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  FusionOptions fusion;
  fusion.voxel_size = 0.05;
  BuildOptions options;
  options.align_axes = false;
  const SampledSource source = sampleFile(path, 0.01, fusion, options, {});
  const auto& geometry = source.field.geometry;
  const Eigen::Vector3d size = (geometry.voxel_size * (geometry.dims - 1).cast<double>()).matrix();
  // One metre and the margin on both sides.
  EXPECT_NEAR(size.maxCoeff(), 1.0 + 2.0 * options.margin, 3.0 * fusion.voxel_size);
  EXPECT_EQ(source.frames, 0U);
}

}  // namespace
}  // namespace ttsdf

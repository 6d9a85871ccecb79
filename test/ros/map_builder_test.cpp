// The map builder from outside: clouds of an analytic room and TF in, services called, the map compared with
// the room.

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/transform_broadcaster.h>
#include <visualization_msgs/Marker.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

#include "../support/temp_folder.h"
#include "synthetic_scans.h"
#include "ttsdf_localization/BuildMap.h"
#include "ttsdf_localization/BuildProgress.h"
#include "ttsdf_localization/GetMap.h"
#include "ttsdf_localization/LoadMap.h"
#include "ttsdf_localization/SaveMap.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {
namespace {

using ttsdf_localization::BuildMap;
using ttsdf_localization::GetMap;
using ttsdf_localization::LoadMap;
using ttsdf_localization::SaveMap;

constexpr int kViews = 24;
constexpr double kVoxelSize = 0.03;  // as map_builder.test says [m]

class MapBuilder : public ::testing::Test {
 protected:
  void SetUp() override {
    progress_subscriber_ = nh_.subscribe("builder/progress", 100, &MapBuilder::onProgress, this);
    cloud_ = nh_.advertise<sensor_msgs::PointCloud2>("cloud", 100);
    ASSERT_TRUE(ros::service::waitForService("builder/reset", ros::Duration(20.0)));
    ASSERT_TRUE(spinUntil([this] { return cloud_.getNumSubscribers() > 0 && heard_progress_; }));
    std_srvs::Trigger reset;
    ASSERT_TRUE(ros::service::call("builder/reset", reset));
    ASSERT_TRUE(reset.response.success);
    ASSERT_TRUE(spinUntil([this] { return progress_.received == 0; }));
  }

  void onProgress(const ttsdf_localization::BuildProgress& message) {
    progress_ = message;
    heard_progress_ = true;
  }

  static bool spinUntil(const std::function<bool()>& done, double seconds = 90.0) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(seconds);
    while (!done() && ros::ok() && ros::WallTime::now() < end) {
      ros::spinOnce();
      ros::WallDuration(0.01).sleep();
    }
    return done();
  }

  /// Renders and publishes views with stamps start, start + 0.1, ...
  void publishViews(int first, int count, const ros::Time& start, bool with_transform = true) {
    const auto views = roomViews(kViews);
    for (int n = 0; n < count; ++n) {
      const Eigen::Isometry3d& T = views[static_cast<std::size_t>((first + n) % kViews)];
      const ros::Time stamp = start + ros::Duration(0.1 * n);
      if (with_transform) broadcaster_.sendTransform(stampedTransform(T, "map", "camera", stamp));
      cloud_.publish(organizedCloud(camera_.render(world_.scene, T), camera_.intrinsics(), "camera", stamp));
    }
  }

  void fuseRoom() {
    publishViews(0, kViews, ros::Time(100.0));
    ASSERT_TRUE(spinUntil([this] { return progress_.fused == kViews; })) << progress_;
  }

  static BuildMap build(const std::function<void(BuildMap::Request&)>& change = {}) {
    BuildMap service;
    service.request.max_rank = "30";
    if (change) change(service.request);
    EXPECT_TRUE(ros::service::call("builder/build_map", service));
    return service;
  }

  /// Median and share within a voxel of |field| on the visible surface points of the views, which lie on the
  /// true surface.
  void expectFieldIsZeroOnSurfaces(const TtSdfMap& map) {
    const auto field = makeField(map);
    std::vector<double> residuals;
    for (const auto& T : roomViews(kViews)) {
      const auto points = toPoints(camera_.render(world_.scene, T), camera_.intrinsics(), 4, 0.3, 3.5);
      const auto samples = field->evaluate(((T.cast<float>() * points).eval()));
      for (Eigen::Index n = 0; n < samples.values.size(); ++n) {
        if (samples.states[static_cast<std::size_t>(n)] == PointState::kValid) {
          residuals.push_back(std::abs(static_cast<double>(samples.values[n])));
        }
      }
    }
    ASSERT_GT(residuals.size(), 5000U);
    std::sort(residuals.begin(), residuals.end());
    EXPECT_LT(residuals[residuals.size() / 2], 0.25 * map.geometry.voxel_size);
    EXPECT_LT(residuals[residuals.size() * 9 / 10], map.geometry.voxel_size);
  }

  ros::NodeHandle nh_;
  ros::Subscriber progress_subscriber_;
  ros::Publisher cloud_;
  tf2_ros::TransformBroadcaster broadcaster_;
  ttsdf_localization::BuildProgress progress_;
  bool heard_progress_ = false;
  testing::TempFolder folder_;
  const World world_ = makeWorld("room");
  const DepthCamera camera_{testCamera()};
};

TEST_F(MapBuilder, RefusesToBuildFromNothing) {
  const BuildMap result = build();
  EXPECT_FALSE(result.response.success);
  EXPECT_NE(result.response.message.find("nothing was fused yet"), std::string::npos)
      << result.response.message;
}

TEST_F(MapBuilder, BuildsTheRoomThatTheCloudsShow) {
  fuseRoom();
  const std::string file = folder_ / "room.ttsdf";
  const BuildMap result = build([&](BuildMap::Request& request) { request.filename = file; });
  ASSERT_TRUE(result.response.success) << result.response.message;
  const auto& report = result.response.report;
  EXPECT_EQ(report.map_id, result.response.map_id);
  EXPECT_EQ(report.scans, static_cast<std::uint32_t>(kViews));
  EXPECT_LE(report.ranks[0], 30U);
  EXPECT_LE(report.ranks[1], 30U);
  EXPECT_FALSE(report.steps.empty());
  EXPECT_EQ(report.steps.size(), report.seconds.size());

  const auto bytes = readFile(file);
  EXPECT_EQ(bytes.size(), report.file_bytes);
  EXPECT_EQ(fileInfo(bytes.data(), bytes.size()).map_id, result.response.map_id);
  const TtSdfMap map = deserialize(bytes.data(), bytes.size());
  EXPECT_EQ(map.frame_id, "map");
  expectFieldIsZeroOnSurfaces(map);

  GetMap get;
  ASSERT_TRUE(ros::service::call("get_map", get));
  ASSERT_TRUE(get.response.success);
  EXPECT_EQ(get.response.map.map_id, result.response.map_id);
  EXPECT_EQ(get.response.map.data, bytes);
  const auto latched =
      ros::topic::waitForMessage<ttsdf_localization::TtSdfMap>("ttsdf_map", nh_, ros::Duration(60.0));
  ASSERT_NE(latched, nullptr);
  EXPECT_EQ(latched->map_id, result.response.map_id);
}

TEST_F(MapBuilder, ShowsSurfaceAndSliceOfTheMap) {
  fuseRoom();
  ASSERT_TRUE(build().response.success);
  const auto surface =
      ros::topic::waitForMessage<visualization_msgs::Marker>("builder/surface", nh_, ros::Duration(60.0));
  ASSERT_NE(surface, nullptr);
  EXPECT_EQ(surface->header.frame_id, "map");
  EXPECT_EQ(surface->type, visualization_msgs::Marker::TRIANGLE_LIST);
  ASSERT_GT(surface->points.size(), 3000U);
  ASSERT_EQ(surface->points.size() % 3, 0U);
  EXPECT_EQ(surface->colors.size(), surface->points.size());
  std::size_t on_surface = 0;
  for (const auto& p : surface->points) {
    if (std::abs(world_.scene.signedDistance({p.x, p.y, p.z})) < kVoxelSize) ++on_surface;
  }
  EXPECT_GT(on_surface, surface->points.size() * 98 / 100);
  const auto slice =
      ros::topic::waitForMessage<sensor_msgs::PointCloud2>("builder/slice", nh_, ros::Duration(60.0));
  ASSERT_NE(slice, nullptr);
  EXPECT_GT(slice->width * slice->height, 10000U);
}

TEST_F(MapBuilder, RequestOverridesTheParameters) {
  fuseRoom();
  const BuildMap result = build([](BuildMap::Request& request) {
    request.max_rank = "8,12";
    request.field = "tsdf";
    request.encoding = "float32";
    request.options = {"margin=0.1", "align_axes=false"};
  });
  ASSERT_TRUE(result.response.success) << result.response.message;
  EXPECT_LE(result.response.report.ranks[0], 8U);
  EXPECT_LE(result.response.report.ranks[1], 12U);
  EXPECT_EQ(result.response.report.field, "tsdf");
  EXPECT_EQ(result.response.report.encoding, "float32");
}

TEST_F(MapBuilder, NamesWhatIsWrongWithARequestAndKeepsTheMap) {
  fuseRoom();
  const BuildMap good = build();
  ASSERT_TRUE(good.response.success);
  const auto message_of = [](const std::function<void(BuildMap::Request&)>& change) {
    const BuildMap result = build(change);
    EXPECT_FALSE(result.response.success);
    return result.response.message;
  };
  EXPECT_NE(message_of([](auto& r) { r.encoding = "morse"; }).find("morse"), std::string::npos);
  EXPECT_NE(message_of([](auto& r) { r.tolerance = -0.5; }).find("tolerance"), std::string::npos);
  EXPECT_NE(message_of([](auto& r) { r.tolerance = std::nan(""); }).find("tolerance"), std::string::npos);
  EXPECT_NE(message_of([](auto& r) { r.options = {"colour=red"}; }).find("colour"), std::string::npos);
  EXPECT_NE(message_of([](auto& r) { r.options = {"margin"}; }).find("name=value"), std::string::npos);
  EXPECT_NE(message_of([](auto& r) { r.filename = "room.ttsdf"; }).find("absolute"), std::string::npos);
  EXPECT_NE(message_of([](auto& r) { r.source = "/nowhere/x.vdb"; }).find("/nowhere/x.vdb"),
            std::string::npos);
  EXPECT_NE(message_of([](auto& r) { r.source = "/nowhere/x.jpg"; }).find(".vdb"), std::string::npos);
  GetMap get;
  ASSERT_TRUE(ros::service::call("get_map", get));
  EXPECT_EQ(get.response.map.map_id, good.response.map_id);
}

TEST_F(MapBuilder, SavesAndLoads) {
  fuseRoom();
  const BuildMap first = build();
  ASSERT_TRUE(first.response.success);
  SaveMap save;
  save.request.filename = folder_ / "first.ttsdf";
  save.request.vdb_filename = folder_ / "volume.vdb";
  ASSERT_TRUE(ros::service::call("builder/save_map", save));
  ASSERT_TRUE(save.response.success) << save.response.message;
  EXPECT_EQ(save.response.map_id, first.response.map_id);

  // The saved volume gives the same map again.
  const BuildMap again =
      build([&](BuildMap::Request& request) { request.source = save.request.vdb_filename; });
  ASSERT_TRUE(again.response.success) << again.response.message;
  EXPECT_EQ(again.response.report.dims, first.response.report.dims);

  const BuildMap second = build([](BuildMap::Request& request) { request.max_rank = "10"; });
  ASSERT_TRUE(second.response.success);
  ASSERT_NE(second.response.map_id, first.response.map_id);
  LoadMap load;
  load.request.filename = save.request.filename;
  ASSERT_TRUE(ros::service::call("builder/load_map", load));
  ASSERT_TRUE(load.response.success) << load.response.message;
  EXPECT_EQ(load.response.map_id, first.response.map_id);
}

TEST_F(MapBuilder, RefusesBadFilesAndKeepsTheMap) {
  fuseRoom();
  const BuildMap good = build();
  ASSERT_TRUE(good.response.success);
  const std::string bad = folder_ / "bad.ttsdf";
  writeFileAtomically(bad, {'n', 'o', ' ', 'm', 'a', 'p'});
  for (const std::string& file :
       {bad, folder_ / "missing.ttsdf", std::string("relative.ttsdf"), folder_.path()}) {
    LoadMap load;
    load.request.filename = file;
    ASSERT_TRUE(ros::service::call("builder/load_map", load));
    EXPECT_FALSE(load.response.success) << file;
    EXPECT_FALSE(load.response.message.empty());
  }
  SaveMap save;
  save.request.filename = "/nowhere/map.ttsdf";
  ASSERT_TRUE(ros::service::call("builder/save_map", save));
  EXPECT_FALSE(save.response.success);
  EXPECT_NE(save.response.message.find("/nowhere"), std::string::npos) << save.response.message;
  GetMap get;
  ASSERT_TRUE(ros::service::call("get_map", get));
  EXPECT_EQ(get.response.map.map_id, good.response.map_id);
}

TEST_F(MapBuilder, CountsBadCloudsAndGoesOn) {
  const ros::Time stamp(200.0);
  broadcaster_.sendTransform(stampedTransform(Eigen::Isometry3d::Identity(), "map", "camera", stamp));
  sensor_msgs::PointCloud2 cloud = organizedCloud(camera_.render(world_.scene, roomViews(kViews)[0]),
                                                  camera_.intrinsics(), "camera", stamp);
  sensor_msgs::PointCloud2 empty, all_nan = cloud, no_x = cloud, truncated = cloud;
  empty.header = cloud.header;
  for (sensor_msgs::PointCloud2Iterator<float> xyz(all_nan, "x"); xyz != xyz.end(); ++xyz) {
    xyz[0] = xyz[1] = xyz[2] = std::numeric_limits<float>::quiet_NaN();
  }
  no_x.fields[0].name = "intensity";
  truncated.data.resize(100);
  for (const auto& bad : {empty, all_nan, no_x, truncated}) cloud_.publish(bad);
  EXPECT_TRUE(spinUntil([this] { return progress_.refused == 4; })) << progress_;

  sensor_msgs::PointCloud2 unstamped = cloud, nameless = cloud;
  unstamped.header.stamp = ros::Time(0);
  nameless.header.frame_id = "";
  cloud_.publish(nameless);
  cloud_.publish(unstamped);
  publishViews(0, 3, stamp + ros::Duration(1.0));
  EXPECT_TRUE(spinUntil([this] { return progress_.fused == 3 && progress_.without_transform == 2; }))
      << progress_;
}

TEST_F(MapBuilder, DoesNotFuseCloudsWithoutTransform) {
  publishViews(0, 3, ros::Time(300.0), false);
  publishViews(0, 3, ros::Time(302.0));
  EXPECT_TRUE(spinUntil([this] { return progress_.fused == 3; })) << progress_;
  EXPECT_EQ(progress_.received, 6U);
}

TEST_F(MapBuilder, GoesOnWhenTheBagLoops) {
  publishViews(0, 5, ros::Time(500.0));
  ASSERT_TRUE(spinUntil([this] { return progress_.fused == 5; })) << progress_;
  // The first clouds after the jump may be lost with the transforms of the old lap; then it goes on.
  for (int n = 0; n < 100 && progress_.fused < 10; ++n) {
    publishViews(n, 1, ros::Time(400.0 + 0.1 * n));
    spinUntil([this] { return progress_.fused >= 10; }, 0.1);
  }
  EXPECT_GE(progress_.fused, 10U) << progress_;
}

TEST_F(MapBuilder, ForgetsOnReset) {
  fuseRoom();
  ASSERT_TRUE(build().response.success);
  std_srvs::Trigger reset;
  ASSERT_TRUE(ros::service::call("builder/reset", reset));
  EXPECT_TRUE(reset.response.success);
  EXPECT_TRUE(spinUntil([this] { return progress_.fused == 0 && progress_.received == 0; }));
  EXPECT_FALSE(build().response.success);
  fuseRoom();
  EXPECT_TRUE(build().response.success);
}

}  // namespace
}  // namespace ttsdf

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "map_builder_test");
  return RUN_ALL_TESTS();
}

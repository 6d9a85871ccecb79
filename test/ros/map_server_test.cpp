// map_server_node as a user starts it: with a good file, a bad one, none.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <nav_msgs/OccupancyGrid.h>
#include <ros/ros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <string>
#include <vector>

#include "../support/temp_folder.h"
#include "ttsdf_localization/GetMap.h"
#include "ttsdf_localization/QueryDistances.h"
#include "ttsdf_localization/compression/map_writer.h"
#include "ttsdf_localization/compression/tt_svd.h"

namespace ttsdf {
namespace {

/// A child process whose output goes to a file.
class Process {
 public:
  Process(const std::vector<std::string>& command, const std::string& output) {
    pid_ = fork();
    if (pid_ != 0) return;
    const int file = open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(file, 1);
    dup2(file, 2);
    std::vector<char*> arguments;
    for (const auto& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  ~Process() {
    if (pid_ > 0) {
      kill(pid_, SIGINT);
      wait();
    }
  }
  /// Exit code; -1: ended by a signal.
  int wait() {
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t pid_ = 0;
};

/// Distance to the plane x = 0.5 in a small box.
TtSdfMap smallMap() {
  DenseTensor tensor(Dims(12, 10, 8));
  for (int k = 0; k < 8; ++k) {
    for (int j = 0; j < 10; ++j) {
      for (int i = 0; i < 12; ++i) tensor(i, j, k) = 0.1F * static_cast<float>(i) - 0.5F;
    }
  }
  TtSdfMap map;
  map.train = ttSvd(tensor, {}).train;
  map.geometry.dims = tensor.dims();
  map.geometry.voxel_size = 0.1;
  map.truncation = 0.3;
  map.frame_id = "hall";
  return map;
}

class MapServer : public ::testing::Test {
 protected:
  void SetUp() override {
    output_ = folder_ / "output.txt";
    map_file_ = folder_ / "map.ttsdf";
    saveMap(smallMap(), map_file_);
  }

  std::string output() const { return testing::fileContent(output_); }
  std::vector<std::string> command(const std::string& argument) const {
    std::vector<std::string> words{MAP_SERVER_NODE, "__name:=map_server", "__log:=" + folder_.file("log")};
    if (!argument.empty()) words.insert(words.begin() + 1, argument);
    return words;
  }

  testing::TempFolder folder_;
  std::string output_, map_file_;
};

TEST_F(MapServer, OffersTheFileByTopicAndService) {
  const Process server(command(map_file_), output_);
  ASSERT_TRUE(ros::service::waitForService("get_map", ros::Duration(20.0))) << output();
  const auto bytes = readFile(map_file_);
  ttsdf_localization::GetMap get;
  ASSERT_TRUE(ros::service::call("get_map", get));
  EXPECT_TRUE(get.response.success) << get.response.message;
  EXPECT_EQ(get.response.map.data, bytes);
  EXPECT_EQ(get.response.map.header.frame_id, "hall");
  EXPECT_EQ(get.response.map.map_id, fileInfo(bytes.data(), bytes.size()).map_id);
  EXPECT_EQ(get.response.map.dims[0], 12U);
  EXPECT_EQ(get.response.map.dims[2], 8U);

  ros::NodeHandle nh;
  const auto latched =
      ros::topic::waitForMessage<ttsdf_localization::TtSdfMap>("ttsdf_map", nh, ros::Duration(10.0));
  ASSERT_NE(latched, nullptr);
  EXPECT_EQ(latched->data, bytes);
}

TEST_F(MapServer, OffersAGridAndDistancesForPlanners) {
  const Process server(command(map_file_), output_);
  ASSERT_TRUE(ros::service::waitForService("query_distances", ros::Duration(20.0))) << output();
  ttsdf_localization::QueryDistances query;
  query.request.points.resize(3);
  query.request.points[0].x = 0.7, query.request.points[0].y = query.request.points[0].z = 0.3;
  query.request.points[1].x = 0.45, query.request.points[1].y = query.request.points[1].z = 0.4;
  query.request.points[2].x = -5.0;
  ASSERT_TRUE(ros::service::call("query_distances", query));
  ASSERT_TRUE(query.response.success) << query.response.message;
  EXPECT_EQ(query.response.frame_id, "hall");
  EXPECT_NEAR(query.response.distances.at(0), 0.2, 1e-4);
  EXPECT_NEAR(query.response.distances.at(1), -0.05, 1e-4);
  EXPECT_NEAR(query.response.gradients.at(0).x, 1.0, 1e-3);
  EXPECT_TRUE(query.response.valid.at(0) && query.response.valid.at(1));
  EXPECT_FALSE(query.response.valid.at(2));

  ros::NodeHandle nh;
  const auto grid =
      ros::topic::waitForMessage<nav_msgs::OccupancyGrid>("occupancy_grid", nh, ros::Duration(10.0));
  ASSERT_NE(grid, nullptr);
  EXPECT_EQ(grid->header.frame_id, "hall");
  EXPECT_FLOAT_EQ(grid->info.resolution, 0.1F);
  const auto cell = [&grid](double x, double y) {
    const auto column = static_cast<std::size_t>((x - grid->info.origin.position.x) / 0.1);
    const auto row = static_cast<std::size_t>((y - grid->info.origin.position.y) / 0.1);
    return static_cast<int>(grid->data.at(row * grid->info.width + column));
  };
  EXPECT_EQ(cell(0.95, 0.45), 0);
  EXPECT_EQ(cell(0.25, 0.45), 100);
}

TEST_F(MapServer, TakesTheFileFromAParameter) {
  ros::param::set("/map_server/map_file", map_file_);
  const Process server(command(""), output_);
  EXPECT_TRUE(ros::service::waitForService("get_map", ros::Duration(20.0))) << output();
  ros::param::del("/map_server/map_file");
}

TEST_F(MapServer, EndsWithAnErrorForADamagedFile) {
  auto bytes = readFile(map_file_);
  bytes[bytes.size() / 2] ^= 0x10;
  writeFileAtomically(map_file_, bytes);
  Process server(command(map_file_), output_);
  EXPECT_EQ(server.wait(), 1);
  EXPECT_NE(output().find(map_file_), std::string::npos) << output();
}

TEST_F(MapServer, EndsWithAnErrorForAForeignAMissingAndNoFile) {
  writeFileAtomically(map_file_, {'P', 'N', 'G'});
  EXPECT_EQ(Process(command(map_file_), output_).wait(), 1);
  EXPECT_NE(output().find(map_file_), std::string::npos) << output();
  EXPECT_EQ(Process(command(folder_ / "missing.ttsdf"), output_).wait(), 1);
  EXPECT_NE(output().find("missing.ttsdf"), std::string::npos) << output();
  EXPECT_EQ(Process(command(""), output_).wait(), 1);
  EXPECT_NE(output().find("map_file"), std::string::npos) << output();
}

}  // namespace
}  // namespace ttsdf

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "map_server_test");
  const ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}

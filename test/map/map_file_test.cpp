// Map files on disk.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>

#include "../support/temp_folder.h"
#include "room_map.h"

namespace ttsdf {
namespace {

namespace fs = std::filesystem;

class MapFile : public ::testing::Test {
 protected:
  std::string path(const std::string& file = "room.ttsdf") const { return folder_ / file; }
  std::size_t filesInFolder() const { return folder_.count(); }
  testing::TempFolder folder_;
};

std::string messageOf(const std::function<void()>& action) {
  return testing::thrownMessage<std::exception>(action);
}

TEST_F(MapFile, SavedMapsAreLoadedAgain) {
  saveMap(test::roomMap(), path());
  EXPECT_EQ(loadMap(path()).train.middle(), test::roomMap().train.middle());
  EXPECT_EQ(readFile(path()), serialize(test::roomMap()));
}

TEST_F(MapFile, SavingReplacesTheOldFileAndLeavesNothingElse) {
  saveMap(test::roomMap(), path());
  TtSdfMap other = test::roomMap();
  other.frame_id = "other";
  saveMap(other, path());
  EXPECT_EQ(loadMap(path()).frame_id, "other");
  EXPECT_EQ(filesInFolder(), 1u);
}

TEST_F(MapFile, AFailedWriteLeavesTheOldFile) {
  saveMap(test::roomMap(), path());
  const auto before = readFile(path());
  // A full disk, as far as the process can tell.
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit full{1000, limit.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &full);
  EXPECT_THROW(writeFileAtomically(path(), std::vector<std::uint8_t>(5000, 1)), std::runtime_error);
  setrlimit(RLIMIT_FSIZE, &limit);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(readFile(path()), before);
  EXPECT_EQ(filesInFolder(), 1u);
}

TEST_F(MapFile, AMapThatCannotBeEncodedLeavesTheOldFile) {
  saveMap(test::roomMap(), path());
  TtSdfMap bad = test::roomMap();
  bad.truncation = -1.0;
  EXPECT_THROW(saveMap(bad, path()), std::invalid_argument);
  EXPECT_EQ(loadMap(path()).truncation, test::roomMap().truncation);
}

TEST_F(MapFile, AMapThatTheReaderWouldRefuseIsNotWritten) {
  saveMap(test::roomMap(), path());
  const auto before = readFile(path());
  for (const Encoding encoding : {Encoding::kFloat32, Encoding::kFloat16, Encoding::kQuantized}) {
    for (const double entry : {1e20, 1e30, 3e38}) {
      TtSdfMap bad = test::roomMap();
      const TensorTrain& train = bad.train;
      const auto factor = static_cast<float>(entry / train.middle().cwiseAbs().maxCoeff());
      bad.train = TensorTrain(train.axes(), train.first(), factor * train.middle(), train.last());
      EncodeOptions options;
      options.encoding = encoding;
      const std::string message = messageOf([&] { saveMap(bad, path(), options); });
      if (message.empty()) {
        EXPECT_NO_THROW(loadMap(path())) << name(encoding) << ' ' << entry;
        saveMap(test::roomMap(), path());
      }
      EXPECT_EQ(readFile(path()), before) << name(encoding) << ' ' << entry;
    }
  }
}

TEST_F(MapFile, OnlyMapsAreReplaced) {
  std::ofstream(path(".bashrc")) << "alias ll='ls -l'";
  EXPECT_NE(messageOf([&] { saveMap(test::roomMap(), path(".bashrc")); }).find("not a map"),
            std::string::npos);
}

TEST_F(MapFile, ErrorsNameTheFile) {
  EXPECT_NE(messageOf([&] { loadMap(path("none.ttsdf")); }).find("none.ttsdf"), std::string::npos);
  EXPECT_NE(messageOf([&] { saveMap(test::roomMap(), path("no/folder.ttsdf")); }).find("no/folder.ttsdf"),
            std::string::npos);
  std::ofstream(path("mesh.ply")) << "ply\nformat ascii 1.0\nelement vertex 0\n";
  EXPECT_NE(messageOf([&] { loadMap(path("mesh.ply")); }).find("mesh.ply"), std::string::npos);
  EXPECT_THROW(loadMap(path("mesh.ply")), MapFormatError);
}

TEST_F(MapFile, FoldersAndPipesAreRefusedAtOnce) {
  EXPECT_THROW(readFile(folder_.path()), std::runtime_error);
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_THROW(readFile(path("pipe")), std::runtime_error);
}

TEST_F(MapFile, FilesAboveTheLimitAreNotRead) {
  writeFileAtomically(path(), std::vector<std::uint8_t>(1001, 1));
  EXPECT_EQ(readFile(path(), 1001).size(), 1001u);
  EXPECT_THROW(readFile(path(), 1000), std::runtime_error);
  fs::resize_file(path(), std::uintmax_t{1} << 40);  // sparse
  EXPECT_THROW(loadMap(path()), std::runtime_error);
}

}  // namespace
}  // namespace ttsdf

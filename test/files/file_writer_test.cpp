// Files that are whole or not there.

#include "ttsdf_localization/files/file_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "../support/temp_folder.h"

namespace ttsdf {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;
const FileKind kLetter{"a letter", "DEAR"};
const Bytes kNew{'D', 'E', 'A', 'R', '!'};

class FileWriterTest : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }
  void put(const std::string& name, const std::string& text) const { folder_.write(name, text); }
  std::string text(const std::string& name) const { return testing::fileContent(path(name)); }
  std::size_t files() const { return folder_.count(); }
  testing::TempFolder folder_;
};

template <class Action>
std::string messageOf(const Action& action) {
  return testing::thrownMessage<std::exception>(action);
}

TEST_F(FileWriterTest, TakesBytesOfAnyContainerWhereTheyLie) {
  const std::string given(100000, 'y');
  writeFileAtomically(path("a"), given.data(), given.size());
  EXPECT_EQ(text("a"), given);
  writeFileAtomically(path("a"), nullptr, 0);
  EXPECT_EQ(text("a"), "");
}

TEST_F(FileWriterTest, OneTargetHasOneName) {
  fs::create_directory(folder_ / "sub");
  put("old", "x");
  fs::create_symlink("sub", path("link"));
  fs::create_symlink("old", path("to_old"));
  fs::create_symlink("sub/new", path("dangling"));
  fs::create_symlink("circle", path("circle"));
  const std::string home = fs::canonical(folder_.path()).string();
  for (const char* name : {"old", "./old", "sub/../old", "nowhere/../old", "to_old", "link/../old"})
    EXPECT_EQ(targetOf(path(name)), home + "/old") << name;
  for (const char* name : {"sub/new", "link/new", "dangling", "sub//new"})
    EXPECT_EQ(targetOf(path(name)), home + "/sub/new") << name;
  EXPECT_EQ(targetOf("new"), (fs::current_path() / "new").string());
  EXPECT_NE(messageOf([&] { targetOf(path("circle")); }).find("circle"), std::string::npos);
}

TEST_F(FileWriterTest, WritesAndReplacesAndLeavesNothingElse) {
  writeFileAtomically(path("a"), kNew);
  EXPECT_EQ(text("a"), "DEAR!");
  writeFileAtomically(path("a"), Bytes(200000, 'x'));
  EXPECT_EQ(text("a"), std::string(200000, 'x'));
  EXPECT_EQ(files(), 1U);
}

TEST_F(FileWriterTest, DevicesPipesAndFoldersStayWhatTheyAre) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  fs::create_directory(path("folder"));
  fs::create_symlink("pipe", path("link"));
  for (const char* name : {"pipe", "folder", "link"}) {
    EXPECT_NE(
        messageOf([&] { writeFileAtomically(path(name), kNew); }).find("wanted nothing or a regular file"),
        std::string::npos)
        << name;
  }
  EXPECT_TRUE(fs::is_fifo(path("pipe")));
  EXPECT_TRUE(fs::is_directory(path("folder")));
  EXPECT_EQ(files(), 3U);
}

TEST_F(FileWriterTest, ADeviceNodeStaysADeviceNode) {
  if (mknod(path("null").c_str(), S_IFCHR | 0600, makedev(1, 3)) != 0)
    GTEST_SKIP() << "may not make device nodes";
  EXPECT_THROW(writeFileAtomically(path("null"), kNew), std::runtime_error);
  EXPECT_THROW(OutputFile(path("null")), std::runtime_error);
  EXPECT_TRUE(fs::is_character_file(path("null")));
}

TEST_F(FileWriterTest, ALinkStaysAndWhatItPointsToIsReplaced) {
  fs::create_directory(path("maps"));
  put("maps/a", "old");
  fs::create_symlink("maps/a", path("one"));
  fs::create_symlink("one", path("two"));
  fs::create_symlink("maps/none", path("dangling"));
  writeFileAtomically(path("two"), kNew);
  writeFileAtomically(path("dangling"), kNew);
  EXPECT_TRUE(fs::is_symlink(path("one")) && fs::is_symlink(path("two")) && fs::is_symlink(path("dangling")));
  EXPECT_EQ(text("maps/a"), "DEAR!");
  EXPECT_EQ(text("maps/none"), "DEAR!");
  fs::create_symlink("circle", path("circle"));
  EXPECT_THROW(writeFileAtomically(path("circle"), kNew), std::runtime_error);
}

TEST_F(FileWriterTest, AnotherKindOfFileIsNotReplaced) {
  put(".bashrc", "alias ll='ls -l'\n");
  EXPECT_NE(messageOf([&] { writeFileAtomically(path(".bashrc"), kNew, kLetter); }).find("not a letter"),
            std::string::npos);
  EXPECT_EQ(text(".bashrc"), "alias ll='ls -l'\n");
  put("short", "DE");
  EXPECT_THROW(writeFileAtomically(path("short"), kNew, kLetter), std::runtime_error);
  put("letter", "DEAR old");
  put("empty", "");
  writeFileAtomically(path("letter"), kNew, kLetter);
  writeFileAtomically(path("empty"), kNew, kLetter);
  EXPECT_EQ(text("letter"), "DEAR!");
  EXPECT_EQ(text("empty"), "DEAR!");
}

TEST_F(FileWriterTest, ModeAndOwnerAreKept) {
  put("a", "old");
  ASSERT_EQ(chmod(path("a").c_str(), 0640), 0);
  const bool root = geteuid() == 0;
  if (root) ASSERT_EQ(chown(path("a").c_str(), 12345, 54321), 0);
  writeFileAtomically(path("a"), kNew);
  struct stat status {};
  ASSERT_EQ(stat(path("a").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0640U);
  if (root) EXPECT_TRUE(status.st_uid == 12345 && status.st_gid == 54321);
  const mode_t mask = umask(027);
  writeFileAtomically(path("new"), kNew);
  umask(mask);
  ASSERT_EQ(stat(path("new").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0640U);
}

TEST_F(FileWriterTest, AFullDiskLeavesTheOldFile) {
  put("a", "old");
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit full{1000, limit.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &full);
  EXPECT_THROW(writeFileAtomically(path("a"), Bytes(5000, 1)), std::runtime_error);
  EXPECT_THROW(
      {
        OutputFile file(path("a"));
        file.stream() << std::string(5000, 'x');
        file.close();
      },
      std::runtime_error);
  setrlimit(RLIMIT_FSIZE, &limit);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(text("a"), "old");
  EXPECT_EQ(files(), 1U);
}

TEST_F(FileWriterTest, WhatAKilledWriterLeftIsRemovedAndALivingOneIsLeftAlone) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const FileWriter writer(path("a"));
    kill(getpid(), SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_EQ(files(), 1U);
  FileWriter living(path("a"));
  EXPECT_EQ(files(), 1U) << "the leftover is gone, the new one is there";
  writeFileAtomically(path("a"), kNew);
  EXPECT_EQ(files(), 2U);
  put("a.tmp-notes", "mine");  // six other characters would look like a leftover
  std::ofstream(living.temporary()) << "later";
  living.commit();
  EXPECT_EQ(text("a"), "later");
  EXPECT_EQ(text("a.tmp-notes"), "mine");
}

TEST_F(FileWriterTest, AnOutputFileIsThereWhenItIsClosed) {
  {
    OutputFile file(path("half"));
    file.stream() << "begun";
  }
  EXPECT_FALSE(fs::exists(path("half")));
  OutputFile file(path("whole"));
  file.stream() << "text";
  file.close();
  EXPECT_EQ(text("whole"), "text");
  OutputFile none("");
  none.stream() << "nowhere";
  none.close();
}

TEST_F(FileWriterTest, ErrorsNameTheFile) {
  EXPECT_NE(messageOf([&] { writeFileAtomically(path("no/a"), kNew); }).find("no/a"), std::string::npos);
  EXPECT_THROW(writeFileAtomically("", kNew), std::runtime_error);
  EXPECT_THROW(writeFileAtomically(path(std::string(300, 'a')), kNew), std::runtime_error);
  writeFileAtomically(path(std::string(250, 'a')), kNew);  // a name that leaves no room for a temporary's
  EXPECT_THROW(requireWritable(path("no/a")), std::runtime_error);
  requireWritable(path("b"));
  EXPECT_FALSE(fs::exists(path("b")));
}

TEST_F(FileWriterTest, AMapFolderHasNoWayOut) {
  fs::create_directories(path("maps/floor"));
  fs::create_symlink(folder_.path(), path("maps/out"));
  fs::create_symlink(path("secret"), path("maps/link"));
  fs::create_symlink("floor/a", path("maps/inner"));
  const std::string folder = path("maps");
  for (const char* good : {"maps/a", "maps/floor/a", "maps/./a", "maps/inner"})
    EXPECT_FALSE(pathInFolder("filename", path(good), folder).empty()) << good;
  for (const char* bad : {"a", "maps", "maps/../a", "maps/out/a", "maps/link", "maps2/a"})
    EXPECT_THROW(pathInFolder("filename", path(bad), folder), std::invalid_argument) << bad;
  EXPECT_THROW(pathInFolder("filename", "relative", ""), std::invalid_argument);
  EXPECT_EQ(pathInFolder("filename", "/anywhere", ""), "/anywhere");
}

}  // namespace
}  // namespace ttsdf

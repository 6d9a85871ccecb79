#include "ttsdf_localization/tools/scan_io.h"

#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

namespace ttsdf {
namespace {

namespace fs = std::filesystem;

class ScanIo : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("ttsdf_scan_io_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    points_.resize(3, 4);
    points_ << 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, std::numeric_limits<float>::quiet_NaN();
    for (int n = 0; n < 4; ++n) cloud_.push_back({points_(0, n), points_(1, n), points_(2, n)});
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
  }
  void expectPoints(const ScanPoints& read) const {
    ASSERT_EQ(read.cols(), 4);
    EXPECT_EQ(read.leftCols(3), points_.leftCols(3));
    EXPECT_TRUE(std::isnan(read(2, 3)));
  }

  fs::path folder_;
  ScanPoints points_;
  pcl::PointCloud<pcl::PointXYZ> cloud_;
};

TEST_F(ScanIo, ReadsWhatPclWrites) {
  pcl::io::savePCDFileBinaryCompressed(path("a.pcd"), cloud_);
  pcl::io::savePCDFileASCII(path("b.PCD"), cloud_);
  pcl::io::savePLYFileBinary(path("a.ply"), cloud_);
  for (const char* name : {"a.pcd", "b.PCD", "a.ply"}) {
    SCOPED_TRACE(name);
    expectPoints(readScan(path(name)));
  }
}

TEST_F(ScanIo, ReadsPlainFloats) {
  write("a.bin", std::string(reinterpret_cast<const char*>(points_.data()), 12 * 4));
  expectPoints(readScan(path("a.bin")));
  write("empty.bin", "");
  EXPECT_EQ(readScan(path("empty.bin")).cols(), 0);
}

TEST_F(ScanIo, RefusesWhatIsNoScanAndNamesTheFile) {
  write("odd.bin", "12345");
  write("text.pcd", "hello");
  write("noxyz.pcd",
        "VERSION .7\nFIELDS a b\nSIZE 4 4\nTYPE F F\nCOUNT 1 1\nWIDTH 1\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 "
        "0\nPOINTS 1\n"
        "DATA ascii\n1 2\n");
  for (const char* name : {"odd.bin", "text.pcd", "noxyz.pcd", "absent.pcd", "absent.bin"}) {
    try {
      readScan(path(name));
      ADD_FAILURE() << name;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
}

TEST_F(ScanIo, BatchListSkipsCommentsAndKeepsNames) {
  write("list.txt", "# scans\n\na.pcd p.txt t.txt\r\n  b.bin -\n c.ply q.txt -\n");
  const auto entries = readBatch(path("list.txt"));
  ASSERT_EQ(entries.size(), 3u);
  EXPECT_EQ(entries[0].scan, "a.pcd");
  EXPECT_EQ(entries[0].prior, "p.txt");
  EXPECT_EQ(entries[0].truth, std::optional<std::string>("t.txt"));
  EXPECT_EQ(entries[1].prior, "-");
  EXPECT_FALSE(entries[1].truth);
  EXPECT_FALSE(entries[2].truth);
}

TEST_F(ScanIo, BatchListsOfOtherEditors) {
  write("list.txt",
        "\xef\xbb\xbf"
        "a.pcd\tp.txt # the first\n\"#b c.pcd\" p#1.txt\n");
  const auto entries = readBatch(path("list.txt"));
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].scan, "a.pcd");
  EXPECT_FALSE(entries[0].truth);
  EXPECT_EQ(entries[1].scan, "#b c.pcd");
  EXPECT_EQ(entries[1].prior, "p#1.txt");
  for (const std::string& text :
       {std::string("\"a.pcd\"p.txt t.txt\n"), std::string("a.pcd p.txt\0t.txt\n", 18)}) {
    write("list.txt", text);
    EXPECT_THROW(readBatch(path("list.txt")), std::runtime_error) << text;
  }
}

TEST_F(ScanIo, BadBatchListIsRefusedWithItsLine) {
  write("list.txt", "a.pcd p.txt\na.pcd\n");
  try {
    readBatch(path("list.txt"));
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("line 2"), std::string::npos);
  }
  write("empty.txt", "# nothing\n");
  EXPECT_THROW(readBatch(path("empty.txt")), std::runtime_error);
  EXPECT_THROW(readBatch(path("absent.txt")), std::runtime_error);
}

TEST_F(ScanIo, NamesAreFoundBesideTheList) {
  write("x.bin", "");
  EXPECT_EQ(resolveBeside(path("list.txt"), "x.bin"), path("x.bin"));
  EXPECT_EQ(resolveBeside("/elsewhere/list.txt", path("x.bin")), path("x.bin"));
  EXPECT_EQ(resolveBeside(path("list.txt"), "absent.bin"), "absent.bin");
}

TEST(RegistrationCsv, HeaderIsTheAgreedOne) {
  // Read by name; columns are added after the agreed ones.
  EXPECT_EQ(
      std::string(kRegistrationCsvHeader)
          .rfind("scan,prior,points,success,reason,iterations,rms_residual,inlier_ratio,ms,tx,ty,tz,qx,"
                 "qy,qz,qw,translation_error,rotation_error,confidence,degenerate_directions,unmapped_ratio",
                 0),
      0u);
}

TEST(RegistrationCsv, RowHasAsManyCellsAndLeavesErrorsEmptyWithoutTruth) {
  RegistrationRow row;
  row.scan = "a.pcd";
  row.prior = "p.txt";
  row.points = 5;
  row.result.success = true;
  row.result.reason = TerminationReason::kConverged;
  row.result.iterations = 7;
  row.result.T_map_sensor.translation() << 1, 2, 3;
  row.milliseconds = 2.5;
  std::ostringstream out;
  writeRow(out, row);
  const auto commas = [](const std::string& text) { return std::count(text.begin(), text.end(), ','); };
  EXPECT_EQ(out.str().rfind("a.pcd,p.txt,5,1,converged,7,0,0,2.5,1,2,3,0,0,0,1,,,", 0), 0u) << out.str();
  EXPECT_EQ(commas(out.str()), commas(kRegistrationCsvHeader));
  row.error = PoseError{0.01, 0.02};
  row.scan = "a,\"b\".pcd";
  out.str("");
  writeRow(out, row);
  EXPECT_EQ(out.str().rfind("\"a,\"\"b\"\".pcd\",p.txt,5,1,converged,7,0,0,2.5,1,2,3,0,0,0,1,0.01,0.02,", 0),
            0u)
      << out.str();
}

}  // namespace
}  // namespace ttsdf

// What the robot's process loads: the localization nodelet's library and everything that it needs.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <string>

namespace {

/// Output of ldd: the library and all it needs, by name.
std::string neededBy(const std::string& library) {
  const std::string command = "ldd '" + library + "' 2>&1";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::string text;
  std::array<char, 4096> part{};
  while (pipe && std::fgets(part.data(), part.size(), pipe.get())) text += part.data();
  return text;
}

class RobotLibraries : public ::testing::TestWithParam<const char*> {};

TEST_P(RobotLibraries, StaySmall) {
  const std::string needed = neededBy(GetParam());
  EXPECT_NE(needed.find("libttsdf_core"), std::string::npos) << needed;
  EXPECT_EQ(needed.find("not found"), std::string::npos) << needed;
  for (const char* const heavy :
       {"openvdb", "vtk", "libpcl_", "vigra", "assimp", "opencv", "ttsdf_mapping"}) {
    EXPECT_EQ(needed.find(heavy), std::string::npos) << heavy << " in:\n" << needed;
  }
}

INSTANTIATE_TEST_SUITE_P(Localization, RobotLibraries,
                         ::testing::Values(TTSDF_LOCALIZATION_NODELET, TTSDF_LOCALIZATION_NODE));

}  // namespace

#include "ttsdf_localization/readers/child_process.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "../support/temp_folder.h"

namespace ttsdf {
namespace {

using testing::thrownMessage;

std::string messageOf(const std::function<std::string()>& work, ChildLimits limits = {}) {
  return thrownMessage<std::runtime_error>([&] { runInChild("thing 'x'", limits, work); });
}

TEST(ChildProcess, HandsBackWhatTheWorkReturns) {
  EXPECT_EQ(runInChild("x", {}, [] { return std::string("a\0b", 3); }), std::string("a\0b", 3));
  const std::string large(5 << 20, 'y');
  EXPECT_EQ(runInChild("x", {}, [&large] { return large; }), large);
  EXPECT_EQ(runInChild("x", {}, [] { return std::string(); }), "");
}

TEST(ChildProcess, PassesOnErrorsAsTheyAre) {
  EXPECT_EQ(messageOf([]() -> std::string { throw std::runtime_error("mesh 'a': no"); }), "mesh 'a': no");
  EXPECT_EQ(messageOf([]() -> std::string { throw 7; }), "unknown error");
}

TEST(ChildProcess, SurvivesCrashes) {
  EXPECT_NE(messageOf([]() -> std::string { std::abort(); }).find("thing 'x': the file is damaged"),
            std::string::npos);
  EXPECT_NE(messageOf([]() -> std::string {
              volatile int* nowhere = nullptr;
              return std::to_string(*nowhere);
            }).find("crashed"),
            std::string::npos);
}

TEST(ChildProcess, EndsWhatDoesNotEnd) {
  ChildLimits limits;
  limits.seconds = 0.3;
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_NE(messageOf(
                []() -> std::string {
                  for (volatile int n = 0;; n = n + 1) {
                  }
                },
                limits)
                .find("too long"),
            std::string::npos);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), 20.0);
}

#if !defined(__SANITIZE_ADDRESS__)
TEST(ChildProcess, BoundsMemory) {
  ChildLimits limits;
  limits.memory_bytes = 50 << 20;
  EXPECT_NE(messageOf([] { return std::string(std::size_t{200} << 20, 'x'); }, limits).find("memory"),
            std::string::npos);
}
#endif

}  // namespace
}  // namespace ttsdf

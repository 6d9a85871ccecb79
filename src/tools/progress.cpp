#include "ttsdf_localization/tools/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>

namespace ttsdf {

namespace {
constexpr int kBarWidth = 30;
constexpr std::chrono::milliseconds kRedraw{100};
}  // namespace

Progress::Progress() : terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { erase(); }

void Progress::update(const std::string& step, double share) {
  if (!terminal_) return;
  const auto now = std::chrono::steady_clock::now();
  if (drawn_ && step == step_ && now - last_draw_ < kRedraw) return;
  step_ = step;
  last_draw_ = now;
  drawn_ = true;
  const double clamped = std::clamp(share, 0.0, 1.0);
  const int filled = static_cast<int>(clamped * kBarWidth);
  std::fprintf(
      stderr, "\r\033[K[%s%s] %3.0f %% %s", std::string(static_cast<std::size_t>(filled), '#').c_str(),
      std::string(static_cast<std::size_t>(kBarWidth - filled), '.').c_str(), 100.0 * clamped, step.c_str());
  std::fflush(stderr);
}

void Progress::note(const std::string& line) {
  erase();
  std::cerr << line << '\n';
}

void Progress::erase() {
  if (!drawn_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  drawn_ = false;
}

}  // namespace ttsdf

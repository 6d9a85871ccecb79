#include "ttsdf_localization/tools/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <utility>

namespace ttsdf {

namespace {
constexpr int kBarWidth = 30;
constexpr std::chrono::milliseconds kRedraw{100};
constexpr std::chrono::seconds kLongestSilence{4};
}  // namespace

Progress::Progress(std::string program)
    : program_(std::move(program)), terminal_(isatty(STDERR_FILENO) == 1), watch_([this] { watch(); }) {}

Progress::~Progress() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    end_ = true;
    erase();
  }
  ended_.notify_all();
  watch_.join();
}

void Progress::watch() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!end_) {
    const auto due = last_word_ + kLongestSilence;
    if (Clock::now() >= due) {
      say();
    } else {
      ended_.wait_until(lock, due);
    }
  }
}

void Progress::say() {
  last_word_ = Clock::now();
  const double seconds = std::chrono::duration<double>(last_word_ - begin_).count();
  const double percent = 100.0 * std::clamp(share_, 0.0, 1.0);
  const std::string step = step_.empty() ? "reading" : step_;
  if (!terminal_) {
    std::fprintf(stderr, "%s%s%s, %.0f %%, after %.0f s\n", program_.c_str(), program_.empty() ? "" : ": ",
                 step.c_str(), percent, seconds);
    return;
  }
  const auto filled = static_cast<std::size_t>(percent / 100.0 * kBarWidth);
  std::fprintf(stderr, "\r\033[K[%s%s] %3.0f %% %s, %.0f s", std::string(filled, '#').c_str(),
               std::string(kBarWidth - filled, '.').c_str(), percent, step.c_str(), seconds);
  std::fflush(stderr);
  drawn_ = true;
}

void Progress::update(const std::string& step, double share) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool same = step == step_;
  step_ = step;
  share_ = share;
  if (!terminal_ || (drawn_ && same && Clock::now() - last_word_ < kRedraw)) return;
  say();
}

void Progress::note(const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  erase();
  std::cerr << program_ << (program_.empty() ? "" : ": ") << text << '\n';
  last_word_ = Clock::now();
}

void Progress::erase() {
  if (!drawn_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  drawn_ = false;
}

}  // namespace ttsdf

// SPDX-License-Identifier: Apache-2.0
#include "apps/twocone/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include <fmt/format.h>

namespace twocone::cli {
namespace {

constexpr int kWidth = 30;
constexpr std::chrono::seconds kQuiet{2};
constexpr std::chrono::milliseconds kInterval{200};

}  // namespace

ProgressBar::ProgressBar(std::string what) : what_(std::move(what)), terminal_(::isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() { clear(); }

void ProgressBar::clear() {
  if (std::exchange(shown_, false)) fmt::print(stderr, "\r\x1b[K");
}

void ProgressBar::say(const std::string& line) {
  clear();
  fmt::print(stderr, "{}\n", line);
}

void ProgressBar::show(double done) {
  const auto now = Clock::now();
  if (!terminal_ || now - begin_ < kQuiet || now - last_ < kInterval) return;
  last_ = now;
  shown_ = true;
  const double share = std::clamp(done, 0.0, 1.0);
  const double spent_s = std::chrono::duration<double>(now - begin_).count();
  const int filled = static_cast<int>(share * kWidth);
  // Before a fiftieth is done, an estimate would jump about.
  std::string left;
  if (share > 0.02) {
    const int left_s = static_cast<int>(std::lround(spent_s / share * (1 - share)));
    left = fmt::format("{}:{:02} left", left_s / 60, left_s % 60);
  }
  fmt::print(stderr, "\r{} [{}{}] {:3.0f} % {}\x1b[K", what_, std::string(std::size_t(filled), '#'),
             std::string(std::size_t(kWidth - filled), '.'), 100 * share, left);
  std::fflush(stderr);
}

}  // namespace twocone::cli

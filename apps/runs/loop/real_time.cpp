// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/real_time.h"

#include <algorithm>

#include <fmt/format.h>

namespace twocone::runs {
namespace {

/// Longest time until a request to stop is noticed.
constexpr std::chrono::milliseconds kSlice{100};

template <class Stopped>
void sleep_until(RealTime::Clock::time_point due, const Stopped& stopped) {
  while (!stopped() && RealTime::Clock::now() < due) {
    std::this_thread::sleep_until(std::min(due, RealTime::Clock::now() + kSlice));
  }
}

}  // namespace

void RealTime::wait(const std::atomic<bool>& stop) {
  if (!begin_) {
    begin_ = Clock::now();
    sleeper_ = std::jthread([this](const std::stop_token& ended) { sleep_bare(ended); });
  }
  const Clock::time_point when = due(double(late_by_.size()));
  sleep_until(when, [&stop] { return stop.load(); });
  late_by_.emplace_back(Clock::now() - when);
  if (late_by_.back() > kLateShare * period_) ++late_;
}

RealTime::Milliseconds RealTime::left() const {
  return begin_ ? Milliseconds(due(double(late_by_.size())) - Clock::now()) : Milliseconds(0);
}

void RealTime::sleep_bare(const std::stop_token& stop) {
  // Between the frames' times, so that the two do not wake each other.
  for (double number = 0.5; !stop.stop_requested(); ++number) {
    const Clock::time_point when = due(number);
    sleep_until(when, [&stop] { return stop.stop_requested(); });
    if (!stop.stop_requested()) bare_late_by_.emplace_back(Clock::now() - when);
  }
}

std::string RealTime::report() {
  if (!begin_) return "";
  sleeper_.request_stop();
  sleeper_.join();
  return fmt::format(
      "real time, a frame each {:.1f} ms; late is more than {:.1f} ms: {}; of a thread that only sleeps: {}",
      period_.count(), (kLateShare * period_).count(), describe_lateness(late_by_, period_),
      describe_lateness(bare_late_by_, period_));
}

std::string describe_lateness(std::vector<RealTime::Milliseconds> late_by, RealTime::Milliseconds period) {
  if (late_by.empty()) return "none";
  std::sort(late_by.begin(), late_by.end());
  const auto first_late = std::upper_bound(late_by.begin(), late_by.end(), RealTime::kLateShare * period);
  return fmt::format("{} of {} late, median {:.2f} ms, worst {:.2f} ms", late_by.end() - first_late, late_by.size(),
                     late_by[late_by.size() / 2].count(), late_by.back().count());
}

}  // namespace twocone::runs

// SPDX-License-Identifier: Apache-2.0
#include "base/child_process.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <limits>
#include <system_error>

namespace twocone::base {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

int milliseconds_until(SteadyTime deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now()).count();
  return int(std::clamp<std::chrono::milliseconds::rep>(left, 0, std::numeric_limits<int>::max()));
}

SteadyTime deadline_after(std::chrono::nanoseconds timeout) {
  const auto now = std::chrono::steady_clock::now();
  return timeout > SteadyTime::max() - now ? SteadyTime::max() : now + timeout;
}

void measure(const StartedChild& child, ChildResult& result) {
  const std::uint64_t before = result.use ? result.use->peak_bytes : 0;
  if (const auto cpu = child.cpu()) result.use = {*cpu, std::max(before, child.peak_bytes())};
}

/// Reads until the child has ended (then returns kEnded) or must be killed.
ChildResult::End watch(const StartedChild& child, const ChildRequest& request, SteadyTime deadline,
                       ChildResult& result) {
  std::array<pollfd, 4> fds{{{child.end_fd(), POLLIN, 0},
                             {request.stop_fd, POLLIN, 0},
                             {child.output_fd(), POLLIN, 0},
                             {child.errors_fd(), POLLIN, 0}}};
  auto& [ended, stop, output, errors] = fds;
  while (true) {
    const int ready = ::poll(fds.data(), fds.size(), milliseconds_until(deadline));
    if (ready < 0 && errno != EINTR) throw std::system_error(errno, std::generic_category(), "poll");
    if (ready < 0) continue;
    if (stop.revents != 0) return ChildResult::End::kStopped;
    // A process that the child left behind may hold the pipes open or fill them, so their end is not awaited.
    const bool gone = ended.revents != 0;
    if (gone) child.kill_group();
    if (request.measured && (gone || output.revents != 0)) measure(child, result);
    // A closed pipe is always ready. A negative descriptor takes it out of the set.
    if (output.revents != 0 && !drain(child.output_fd(), result.output)) output.fd = -1;
    if (errors.revents != 0 && !drain(child.errors_fd(), result.errors)) errors.fd = -1;
    keep_newest(result.errors);
    if (result.output.size() > request.max_output) return ChildResult::End::kTooMuch;
    if (gone && output.revents == 0 && errors.revents == 0) return ChildResult::End::kEnded;
    // Checked on every turn, not only when poll times out: a child that writes without end keeps poll busy.
    if (std::chrono::steady_clock::now() >= deadline) {
      return gone ? ChildResult::End::kEnded : ChildResult::End::kTimedOut;
    }
  }
}

}  // namespace

StopSignal::StopSignal() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (!fd_.valid()) throw std::system_error(errno, std::generic_category(), "eventfd");
}

void StopSignal::raise() {
  const std::uint64_t one = 1;
  // This fails only if the counter is full, and then the signal is raised already.
  [[maybe_unused]] const auto written = ::write(fd_.get(), &one, sizeof one);
}

void StopSignal::lower() {
  std::uint64_t count = 0;
  // This fails only if the signal is not raised.
  [[maybe_unused]] const auto got = ::read(fd_.get(), &count, sizeof count);
}

ChildResult run_child(const ChildRequest& request) {
  try {
    const SteadyTime deadline = deadline_after(request.timeout);
    StartedChild child(request.program);
    ChildResult result;
    result.end = watch(child, request, deadline, result);
    result.wait_status = child.end();
    if (result.errors.size() > kMaxErrors) result.errors.erase(0, result.errors.size() - kMaxErrors);
    return result;
  } catch (const std::system_error& e) {
    return {ChildResult::End::kNotStarted, 0, {}, e.what(), {}};
  }
}

}  // namespace twocone::base

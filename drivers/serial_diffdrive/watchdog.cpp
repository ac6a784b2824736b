// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/watchdog.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <new>
#include <span>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "base/child_process.h"
#include "base/errors.h"

namespace twocone::serial {
namespace {

constexpr char kWord = 'w';
constexpr char kReady = 'g';
// In the watchdog the port and the pipe have these descriptors, and nothing else is open.
constexpr int kPort = 3;
constexpr int kPipe = 4;
// Time for a new watchdog to become ready. On a machine that is not overloaded it needs a few milliseconds.
constexpr int kPosted_ms = 5'000;
// Time within which the watchdog of an ending program should end.
constexpr std::chrono::milliseconds kEnds{500};
// Time between two checks of the page: a watchdog that is not suspended answers within some 50 us.
constexpr std::chrono::microseconds kNap{50};

std::int64_t steady_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

// Everything from here to become_watchdog runs in a copy of a program that had other threads. Only functions that a
// signal handler may call are allowed, and no memory may be allocated.

using StopBytes = std::span<const std::uint8_t>;

void send_once(StopBytes bytes) {
  for (int tries = 0; !bytes.empty() && tries < 20; ++tries) {
    const ssize_t written = ::write(kPort, bytes.data(), bytes.size());
    if (written > 0) {
      bytes = bytes.subspan(std::size_t(written));
    } else if (written < 0 && errno != EAGAIN && errno != EINTR) {
      return;  // the port is gone
    } else {
      pollfd port{kPort, POLLOUT, 0};
      ::poll(&port, 1, 5);
    }
  }
}

void forget_unsent() { ::tcflush(kPort, TCOFLUSH); }

/// Writes the last stops and exits. The program has ended, or has requested the watchdog's end.
[[noreturn]] void stop_and_exit(WatchdogState& state, StopBytes stop_bytes) {
  forget_unsent();
  for (int i = 0; i < kStopsInARow; ++i) {
    if (i > 0) ::poll(nullptr, 0, int(kBetweenStops.count() / 1'000'000));
    ++state.stops_begun;
    send_once(stop_bytes);
    ++state.stops_done;
  }
  ::_exit(0);
}

[[noreturn]] void run_watchdog(WatchdogState& state, StopBytes stop_bytes, std::int64_t timeout_ns) {
  WatchdogSteps steps(state, timeout_ns);
  while (true) {
    const WatchdogSteps::Step step = steps.next(steady_ns());
    if (step.writes_stop) {
      if (step.is_first) forget_unsent();
      send_once(stop_bytes);
      steps.wrote_stop(steady_ns());
      continue;
    }
    int wait_ms = -1;
    if (step.wake_ns >= 0) {
      wait_ms = int(std::clamp<std::int64_t>((step.wake_ns - steady_ns() + 999'999) / 1'000'000, 0, 3'600'000));
    }
    pollfd pipe{kPipe, POLLIN, 0};
    const int ready = ::poll(&pipe, 1, wait_ms);
    if (ready < 0 && errno != EINTR) stop_and_exit(state, stop_bytes);
    if (ready <= 0) continue;
    std::array<char, 64> words;
    const ssize_t got = ::read(kPipe, words.data(), words.size());
    const bool is_end = got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN);
    if (is_end) stop_and_exit(state, stop_bytes);
  }
}

/// Removes the program's signal handlers, which do not work here. Only the end of the pipe may end a watchdog.
void ignore_signals() {
  for (int number = 1; number < NSIG; ++number) {
    const bool is_fault = number == SIGSEGV || number == SIGBUS || number == SIGILL || number == SIGFPE ||
                          number == SIGABRT || number == SIGTRAP || number == SIGSYS;
    ::signal(number, is_fault ? SIG_DFL : SIG_IGN);
  }
  base::Process::unblock_signals();
}

/// Closes every descriptor except the port and this end of the pipe. In particular, the program's end of the pipe must
/// close with the program.
bool keep_only(int port, int pipe) {
  // Both are duplicated first, because either may have the number that the other will get.
  const int high_port = ::fcntl(port, F_DUPFD, 10);
  const int high_pipe = ::fcntl(pipe, F_DUPFD, 10);
  if (high_port < 0 || high_pipe < 0 || ::dup2(high_port, kPort) < 0 || ::dup2(high_pipe, kPipe) < 0) return false;
  // The program's output must not stay open because of its watchdog.
  for (const int standard : {0, 1, 2}) ::close(standard);
  return ::close_range(kPipe + 1, ~0U, 0) == 0;
}

[[noreturn]] void become_watchdog(int port, int pipe, WatchdogState& state, StopBytes stop_bytes,
                                  std::int64_t timeout_ns) {
  ::setsid();
  ignore_signals();
  ::prctl(PR_SET_NAME, "twocone-watchdog");
  // The system may refuse this. On a busy machine an ordinary process in its own session was observed to wait for half
  // a second.
  const sched_param least{1};
  ::sched_setscheduler(0, SCHED_RR, &least);
  if (!keep_only(port, pipe) || ::chdir("/") != 0 || ::write(kPipe, &kReady, 1) != 1) ::_exit(1);
  run_watchdog(state, stop_bytes, timeout_ns);
}

/// Returns whether the watchdog reports that it is ready.
bool is_ready(int pipe) {
  pollfd entry{pipe, POLLIN, 0};
  char word = 0;
  return TEMP_FAILURE_RETRY(::poll(&entry, 1, kPosted_ms)) > 0 && ::read(pipe, &word, 1) == 1 && word == kReady;
}

/// The program's side of a watchdog in another process.
class WatchdogProcess final : public Watchdog {
 public:
  struct Unmap {
    void operator()(WatchdogState* state) const { ::munmap(state, sizeof *state); }
  };
  using SharedState = std::unique_ptr<WatchdogState, Unmap>;

  WatchdogProcess(SharedState state, base::Process process, base::UniqueFd pipe, std::chrono::nanoseconds timeout)
      : Watchdog(*state, timeout), state_(std::move(state)), process_(std::move(process)), pipe_(std::move(pipe)) {}
  ~WatchdogProcess() override { do_end(kEnds); }

 private:
  Status wake() override {
    while (::send(pipe_.get(), &kWord, 1, MSG_NOSIGNAL | MSG_DONTWAIT) != 1) {
      if (errno == EINTR) continue;
      if (errno == EAGAIN) break;  // enough messages are waiting for it
      return Error(ErrorCode::kUnavailable, "the watchdog, {}, is gone", name());
    }
    return {};
  }
  void do_end(std::chrono::milliseconds patience) noexcept override {
    ::shutdown(pipe_.get(), SHUT_RDWR);  // the watchdog reads the end of the pipe
    // A watchdog that does not end is halted, or blocked by a port that accepts no bytes.
    if (!process_.wait(patience)) process_.kill();
  }
  [[nodiscard]] std::int64_t now_ns() const override { return steady_ns(); }
  void nap() override { std::this_thread::sleep_for(kNap); }
  [[nodiscard]] std::string name() const override { return fmt::format("process {}", process_.pid()); }

  const SharedState state_;
  base::Process process_;
  const base::UniqueFd pipe_;
};

}  // namespace

WatchdogSteps::Step WatchdogSteps::next(std::int64_t now_ns) {
  // The order matters: the deadline that is read below is at least as new as the one that is confirmed here.
  state_.deadlines_seen = state_.deadlines_set.load();
  while (true) {
    const std::int64_t until_ns = state_.moves_until_ns;
    if (left_ > 0 && until_ns != expired_ns_) left_ = 0;  // the program set a new deadline
    if (left_ == 0) {
      if (until_ns == 0) return {};
      if (now_ns < until_ns) return {.wake_ns = until_ns};
      expired_ns_ = until_ns;
      left_ = kStopsInARow;
      next_ns_ = now_ns;
    }
    if (now_ns < next_ns_) return {.wake_ns = next_ns_};
    ++state_.stops_begun;
    if (state_.moves_until_ns == expired_ns_) return {.writes_stop = true, .is_first = left_ == kStopsInARow};
    ++state_.stops_done;
  }
}

void WatchdogSteps::wrote_stop(std::int64_t now_ns) {
  ++state_.stops_done;
  next_ns_ = now_ns + kBetweenStops.count();
  if (--left_ > 0) return;
  std::int64_t expired_ns = expired_ns_;
  state_.moves_until_ns.compare_exchange_strong(expired_ns, now_ns + timeout_ns_);
}

void Watchdog::set_deadline(std::int64_t moves_until_ns) {
  set_at_ns_ = now_ns();
  state_->moves_until_ns = moves_until_ns;
  ++state_->deadlines_set;
}

Status Watchdog::wait_until(bool (*is_true)(const WatchdogState&), std::int64_t limit_ns) {
  while (!is_true(*state_)) {
    const std::int64_t time_ns = now_ns();
    if (time_ns >= limit_ns) {
      return Error(ErrorCode::kUnavailable,
                   "the watchdog, {}, did not run for {:.0f} ms: it is halted, or the machine is overloaded", name(),
                   1e-6 * double(time_ns - set_at_ns_));
    }
    // A message shows that the watchdog is gone; otherwise it would look like a slow one.
    if (auto there = wake(); !there) return there;
    nap();
  }
  return {};
}

Status Watchdog::expect_motion() {
  set_deadline(now_ns() + timeout_.count());
  if (auto there = wake(); !there) return there;
  return settle();
}

Status Watchdog::expect_stop() {
  set_deadline(0);
  return settle();
}

Status Watchdog::settle() {
  return wait_until([](const WatchdogState& state) { return state.stops_done == state.stops_begun; },
                    now_ns() + timeout_.count() / 2);
}

Status Watchdog::wait_until_seen() {
  // The watchdog has had time since the exchange with the controller began. If the exchange took all of it, or if the
  // whole machine was suspended, the watchdog has an eighth of the time-out more.
  const std::int64_t limit_ns = std::max(set_at_ns_ + timeout_.count() / 2, now_ns() + timeout_.count() / 8);
  return wait_until([](const WatchdogState& state) { return state.deadlines_seen == state.deadlines_set; }, limit_ns);
}

Result<std::unique_ptr<Watchdog>> start_watchdog_process(int port, std::vector<std::uint8_t> stop_bytes,
                                                         std::chrono::nanoseconds timeout) {
  if (timeout.count() <= 0) {
    throw base::InvalidArgument("WatchdogProcess: timeout is {} ns, must be > 0", timeout.count());
  }
  const auto unavailable = [](const char* what, int error) {
    return Error(ErrorCode::kUnavailable, "no {} for the watchdog: {}", what, std::strerror(error));
  };
  void* const memory =
      ::mmap(nullptr, sizeof(WatchdogState), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return unavailable("memory", errno);
  WatchdogProcess::SharedState state(new (memory) WatchdogState);
  // The pipe is a socket, because send() has a flag that prevents SIGPIPE.
  std::array<int, 2> ends{-1, -1};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return unavailable("pipe", errno);
  base::UniqueFd ours(ends[0]);
  base::UniqueFd theirs(ends[1]);
  try {
    base::Process process([&] { become_watchdog(port, theirs.get(), *state, stop_bytes, timeout.count()); });
    theirs.reset();
    const bool ready = is_ready(ours.get());
    auto watchdog = std::make_unique<WatchdogProcess>(std::move(state), std::move(process), std::move(ours), timeout);
    if (!ready) return Error{ErrorCode::kUnavailable, "the watchdog process does not start"};
    return std::unique_ptr<Watchdog>(std::move(watchdog));
  } catch (const std::system_error& error) {
    return unavailable("process", error.code().value());
  }
}

}  // namespace twocone::serial

// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/guard.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace twocone::serial {
namespace {

constexpr char kMoves = 'm';
constexpr char kRests = 'r';
constexpr char kReady = 'g';
// In the guard the port and the pipe have these numbers, and nothing else is open.
constexpr int kPort = 3;
constexpr int kPipe = 4;
// Said again, in case that the first was lost in what the program left half sent.
constexpr int kTimesSaid = 3;
constexpr int kPause_ms = 15;
// A new guard is at its post within a few milliseconds, on a machine that has time.
constexpr int kPosted_ms = 5'000;
// For the guard of a busy machine to take words out of a full pipe.
constexpr int kListens_ms = 200;
// Until the guard of a program that ends is gone.
constexpr std::chrono::milliseconds kEnds{500};

std::int64_t now_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

// Everything from here to become_guard runs in a copy of a program that had other threads: only what signal handlers
// may call is allowed, and no memory may be asked for.

void say_once(const std::uint8_t* bytes, std::size_t count) {
  std::size_t sent = 0;
  for (int tries = 0; sent < count && tries < 20; ++tries) {
    const ssize_t written = ::write(kPort, bytes + sent, count - sent);
    if (written > 0) {
      sent += std::size_t(written);
    } else if (written < 0 && errno != EAGAIN && errno != EINTR) {
      return;  // the port is gone
    } else {
      pollfd port{kPort, POLLOUT, 0};
      ::poll(&port, 1, 5);
    }
  }
}

void say_stop(const std::uint8_t* bytes, std::size_t count, bool is_ended) {
  ::tcflush(kPort, TCOFLUSH);  // commands that have not left yet
  for (int i = 0; i < kTimesSaid; ++i) {
    pollfd pipe{kPipe, POLLIN, 0};
    // The end of the pipe is heard for ever: it does not shorten the pause.
    if (i > 0 && is_ended) ::poll(nullptr, 0, kPause_ms);
    if (i > 0 && !is_ended && ::poll(&pipe, 1, kPause_ms) > 0) return;  // the program goes on
    say_once(bytes, count);
  }
}

[[noreturn]] void run_guard(const std::uint8_t* stop_bytes, std::size_t count, std::int64_t timeout_ns) {
  bool moves = false;
  std::int64_t silent_at = 0;
  while (true) {
    int wait_ms = -1;
    if (moves) wait_ms = int(std::clamp<std::int64_t>((silent_at - now_ns() + 999'999) / 1'000'000, 0, 3'600'000));
    pollfd pipe{kPipe, POLLIN, 0};
    const int ready = ::poll(&pipe, 1, wait_ms);
    if (ready > 0) {
      std::array<char, 64> heard;
      const ssize_t got = ::read(kPipe, heard.data(), heard.size());
      if (got > 0) {
        moves = heard[std::size_t(got) - 1] == kMoves;
        silent_at = now_ns() + timeout_ns;
        continue;
      }
      if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      say_stop(stop_bytes, count, true);  // the program has ended
      ::_exit(0);
    }
    if (ready < 0 && errno != EINTR) {
      say_stop(stop_bytes, count, true);
      ::_exit(1);
    }
    if (moves && now_ns() >= silent_at) {
      say_stop(stop_bytes, count, false);
      // Again after as long a silence: a program that was halted between its word to the guard and its command to the
      // controller says the command when it goes on.
      silent_at = now_ns() + timeout_ns;
    }
  }
}

/// The program's handlers are no use here, and nothing but the end of the pipe may end a guard.
void ignore_signals() {
  for (int number = 1; number < NSIG; ++number) {
    const bool is_fault = number == SIGSEGV || number == SIGBUS || number == SIGILL || number == SIGFPE ||
                          number == SIGABRT || number == SIGTRAP || number == SIGSYS;
    ::signal(number, is_fault ? SIG_DFL : SIG_IGN);
  }
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
}

/// Keeps the port and this end of the pipe, and nothing else: the program's own end of the pipe above all must close
/// with the program.
bool keep_only(int port, int pipe) {
  // First out of the way of each other: either may have the other's number.
  const int high_port = ::fcntl(port, F_DUPFD, 10);
  const int high_pipe = ::fcntl(pipe, F_DUPFD, 10);
  if (high_port < 0 || high_pipe < 0 || ::dup2(high_port, kPort) < 0 || ::dup2(high_pipe, kPipe) < 0) return false;
  // The program's output must not stay open because of its guard.
  for (const int standard : {0, 1, 2}) ::close(standard);
  return ::close_range(kPipe + 1, ~0U, 0) == 0;
}

[[noreturn]] void become_guard(int port, int pipe, const std::uint8_t* stop_bytes, std::size_t count,
                               std::int64_t timeout_ns) {
  ::setsid();
  ignore_signals();
  ::prctl(PR_SET_NAME, "twocone-guard");
  // Where it may: on a busy machine an ordinary process of a session of its own was seen to wait for half a second.
  const sched_param least{1};
  ::sched_setscheduler(0, SCHED_RR, &least);
  if (!keep_only(port, pipe) || ::chdir("/") != 0 || ::write(kPipe, &kReady, 1) != 1) ::_exit(1);
  run_guard(stop_bytes, count, timeout_ns);
}

/// A copy of this program that no signal reaches before it has made itself deaf to them.
template <typename Become>
pid_t fork_deaf(Become become) {
  sigset_t all, before;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t process = ::fork();
  if (process == 0) become();
  const int failed = errno;
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  errno = failed;
  return process;
}

/// Whether the guard says that it is at its post.
bool is_ready(int pipe) {
  pollfd entry{pipe, POLLIN, 0};
  int ready = 0;
  do {
    ready = ::poll(&entry, 1, kPosted_ms);
  } while (ready < 0 && errno == EINTR);
  char word = 0;
  return ready > 0 && ::read(pipe, &word, 1) == 1 && word == kReady;
}

}  // namespace

Result<std::unique_ptr<Guard>> Guard::post(int port, std::vector<std::uint8_t> stop_bytes,
                                           std::chrono::nanoseconds timeout) {
  if (timeout.count() <= 0) {
    throw std::invalid_argument(fmt::format("Guard: timeout is {} ns, must be > 0", timeout.count()));
  }
  // A socket, as writing to one can be told not to raise SIGPIPE.
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return Error{ErrorCode::kUnavailable, fmt::format("no pipe for the guard: {}", std::strerror(errno))};
  }
  const pid_t process =
      fork_deaf([&] { become_guard(port, ends[1], stop_bytes.data(), stop_bytes.size(), timeout.count()); });
  const int failed = errno;
  ::close(ends[1]);
  if (process < 0) {
    ::close(ends[0]);
    return Error{ErrorCode::kUnavailable, fmt::format("no process for the guard: {}", std::strerror(failed))};
  }
  std::unique_ptr<Guard> guard(new Guard(process, ends[0]));
  if (!is_ready(ends[0])) return Error{ErrorCode::kUnavailable, "the guard process does not begin"};
  return guard;
}

Guard::~Guard() {
  ::close(pipe_);
  const std::int64_t deadline = now_ns() + std::chrono::nanoseconds(kEnds).count();
  while (::waitpid(process_, nullptr, WNOHANG) == 0) {
    if (now_ns() >= deadline) {
      ::kill(process_, SIGKILL);  // it hangs in a port that takes nothing
      while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
      }
      return;
    }
    ::poll(nullptr, 0, 1);
  }
}

Status Guard::command(bool moves) noexcept {
  const char word = moves ? kMoves : kRests;
  const std::int64_t deadline = now_ns() + std::int64_t(kListens_ms) * 1'000'000;
  while (::send(pipe_, &word, 1, MSG_NOSIGNAL | MSG_DONTWAIT) != 1) {
    if (errno == EINTR) continue;
    if (errno != EAGAIN) return Error{ErrorCode::kUnavailable, "the guard process is gone"};
    if (now_ns() >= deadline) return Error{ErrorCode::kUnavailable, "the guard process does not listen"};
    pollfd pipe{pipe_, POLLOUT, 0};
    ::poll(&pipe, 1, kListens_ms);
  }
  return {};
}

}  // namespace twocone::serial

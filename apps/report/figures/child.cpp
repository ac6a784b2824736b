// SPDX-License-Identifier: Apache-2.0
#include "apps/report/figures/child.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <thread>

#include <fmt/format.h>

namespace twocone::report {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

/// Far more than a figure of a long run needs; a program that writes without end must not fill the memory.
constexpr std::size_t kLargestOutput = 64U << 20U;
/// How often a child that has closed its pipes is polled for its end.
constexpr std::chrono::milliseconds kReapPeriod{2};

class Descriptor {
 public:
  Descriptor() = default;
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  void reset(int fd) { close(), fd_ = fd; }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_ = -1;
};

struct Pipe {
  Descriptor read_end, write_end;

  bool open() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return false;
    read_end.reset(ends[0]);
    write_end.reset(ends[1]);
    return true;
  }
};

/// A started process. It is reaped by wait(), or killed and reaped by the destructor.
class Child {
 public:
  explicit Child(pid_t pid) : pid_(pid) {}
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    int status = 0;
    // This loop ends, because no process survives SIGKILL.
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
  }

  /// Returns the wait status, or nothing at the deadline.
  std::optional<int> wait(SteadyTime deadline) {
    for (;;) {
      int status = 0;
      const pid_t reaped = ::waitpid(pid_, &status, WNOHANG);
      if (reaped == pid_ || (reaped < 0 && errno != EINTR)) {
        pid_ = 0;
        return status;
      }
      if (std::chrono::steady_clock::now() >= deadline) return std::nullopt;
      std::this_thread::sleep_for(kReapPeriod);
    }
  }

 private:
  pid_t pid_;
};

/// File actions and attributes of the spawn: standard streams set up, no signal blocked, SIGPIPE with its default
/// action.
class SpawnSetup {
 public:
  SpawnSetup(const Pipe& out, const Pipe& err) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions_, out.write_end.get(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions_, err.write_end.get(), STDERR_FILENO);
    posix_spawnattr_init(&attributes_);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes_, &none);
    sigset_t defaults;
    sigemptyset(&defaults);
    sigaddset(&defaults, SIGPIPE);
    posix_spawnattr_setsigdefault(&attributes_, &defaults);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~SpawnSetup() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  SpawnSetup(const SpawnSetup&) = delete;
  SpawnSetup& operator=(const SpawnSetup&) = delete;

  /// Returns the errno of a failure, 0 for success.
  int spawn(pid_t& pid, const std::string& program, const std::vector<std::string>& arguments) const {
    std::vector<std::string> words{program};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    argv.reserve(words.size() + 1);
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    return ::posix_spawnp(&pid, program.c_str(), &actions_, &attributes_, argv.data(), environ);
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

Error timed_out(const std::string& program, std::chrono::milliseconds timeout) {
  return {ErrorCode::kTimeout, fmt::format("{} did not end within {} ms and was killed", program, timeout.count())};
}

/// Reads both pipes to their ends.
Status drain(Pipe& out, Pipe& err, ProgramOutput& output, const std::string& program, SteadyTime deadline,
             std::chrono::milliseconds timeout) {
  std::array<Descriptor*, 2> ends{&out.read_end, &err.read_end};
  std::array<std::string*, 2> texts{&output.out, &output.err};
  while (ends[0]->get() >= 0 || ends[1]->get() >= 0) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return timed_out(program, timeout);
    std::array<pollfd, 2> polled{pollfd{ends[0]->get(), POLLIN, 0}, pollfd{ends[1]->get(), POLLIN, 0}};
    if (::poll(polled.data(), polled.size(), static_cast<int>(std::min<long long>(left.count(), 60'000))) < 0) {
      if (errno == EINTR) continue;
      return Error{ErrorCode::kUnavailable, fmt::format("cannot wait for {}: {}", program, std::strerror(errno))};
    }
    for (std::size_t i = 0; i < polled.size(); ++i) {
      if (polled[i].revents == 0) continue;
      std::array<char, 65536> buffer{};
      const ssize_t got = ::read(ends[i]->get(), buffer.data(), buffer.size());
      if (got > 0) {
        texts[i]->append(buffer.data(), static_cast<std::size_t>(got));
      } else if (got == 0 || errno != EINTR) {
        ends[i]->close();
      }
      if (texts[i]->size() > kLargestOutput) {
        return Error{ErrorCode::kBadData,
                     fmt::format("{} wrote over {} MiB and was killed", program, kLargestOutput >> 20U)};
      }
    }
  }
  return {};
}

}  // namespace

Result<ProgramOutput> run_program(const std::string& program, const std::vector<std::string>& arguments,
                                  std::chrono::milliseconds timeout) {
  const SteadyTime deadline = std::chrono::steady_clock::now() + timeout;
  Pipe out;
  Pipe err;
  if (!out.open() || !err.open()) {
    return Error{ErrorCode::kUnavailable, fmt::format("cannot start {}: {}", program, std::strerror(errno))};
  }
  pid_t pid = 0;
  if (const int failure = SpawnSetup(out, err).spawn(pid, program, arguments); failure != 0) {
    return Error{ErrorCode::kUnavailable, fmt::format("cannot start {}: {}", program, std::strerror(failure))};
  }
  Child child(pid);
  out.write_end.close();
  err.write_end.close();

  ProgramOutput output;
  if (const Status drained = drain(out, err, output, program, deadline, timeout); !drained) return drained.error();
  const std::optional<int> status = child.wait(deadline);
  if (!status) return timed_out(program, timeout);
  if (!WIFEXITED(*status)) {
    return Error{ErrorCode::kDisconnected, fmt::format("{} was ended by signal {}", program, WTERMSIG(*status))};
  }
  output.exit_code = WEXITSTATUS(*status);
  return output;
}

}  // namespace twocone::report

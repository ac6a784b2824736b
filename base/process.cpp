// SPDX-License-Identifier: Apache-2.0
#include "base/process.h"

#include <poll.h>
#include <signal.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <string>
#include <utility>

namespace twocone::base {
namespace {

/// Waits for a process that ends soon, because it has ended or was killed, and returns its status.
int reap(pid_t pid) noexcept {
  int status = 0;
  static_cast<void>(TEMP_FAILURE_RETRY(::waitpid(pid, &status, 0)));
  return status;
}

}  // namespace

Process::Process(const std::function<void()>& body) {
  sigset_t all, before;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  pid_ = ::fork();
  if (pid_ == 0) {
    try {
      body();
    } catch (...) {
      ::_exit(1);
    }
    ::_exit(0);
  }
  const int error = errno;
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  errno = error;
  if (pid_ < 0) throw_errno("fork");
  end_fd_ = UniqueFd(int(::syscall(SYS_pidfd_open, pid_, 0U)));
  if (!end_fd_.valid()) {
    const int no_descriptor = errno;
    kill();
    errno = no_descriptor;
    throw_errno("pidfd_open");
  }
}

Process::~Process() { kill(); }

Process::Process(Process&& other) noexcept : pid_(std::exchange(other.pid_, 0)), end_fd_(std::move(other.end_fd_)) {}

Process& Process::operator=(Process&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(end_fd_, other.end_fd_);
  return *this;
}

void Process::signal(int number) const noexcept {
  if (pid_ > 0) ::kill(pid_, number);
}

std::optional<int> Process::wait(std::chrono::milliseconds timeout) noexcept {
  if (pid_ <= 0) return std::nullopt;
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd end{end_fd_.get(), POLLIN, 0};
    const int ready = ::poll(&end, 1, int(std::max<std::int64_t>(left.count(), 0)));
    if (ready > 0) return reap(std::exchange(pid_, 0));
    if (ready == 0 || errno != EINTR) return std::nullopt;
  }
}

int Process::kill() noexcept {
  if (pid_ <= 0) return 0;
  signal(SIGKILL);
  return reap(std::exchange(pid_, 0));
}

void Process::unblock_signals() noexcept {
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
}

std::uint64_t peak_bytes(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string word; status >> word;) {
    std::uint64_t kibibytes = 0;
    if (word == "VmHWM:" && status >> kibibytes) return kibibytes * 1024;
  }
  return 0;
}

}  // namespace twocone::base

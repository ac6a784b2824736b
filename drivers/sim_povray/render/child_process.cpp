// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/child_process.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <limits>
#include <system_error>

namespace twocone::sim_povray {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

[[noreturn]] void throw_errno(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

/// Above every number that the child gives its own descriptors, so that arranging these can overwrite none.
constexpr int kFirstSafeFd = 10;

UniqueFd lifted(int fd) {
  UniqueFd high(::fcntl(fd, F_DUPFD_CLOEXEC, kFirstSafeFd));
  if (!high.valid()) throw_errno("fcntl");
  return high;
}

struct Pipe {
  UniqueFd read;
  UniqueFd write;
};

Pipe make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw_errno("pipe2");
  const UniqueFd low_read(ends[0]);
  const UniqueFd low_write(ends[1]);
  return {lifted(low_read.get()), lifted(low_write.get())};
}

void make_non_blocking(int fd) {
  if (::fcntl(fd, F_SETFL, O_NONBLOCK) != 0) throw_errno("fcntl");
}

/// Pointers for exec; the strings must outlive them.
std::vector<char*> pointers(const std::vector<std::string>& strings) {
  std::vector<char*> result;
  result.reserve(strings.size() + 1);
  for (const auto& s : strings) result.push_back(const_cast<char*>(s.c_str()));
  result.push_back(nullptr);
  return result;
}

/// What the child tells its parent when it cannot become the program.
struct StartFailure {
  enum Step : int { kFolder, kDescriptors, kExec };
  int step;
  int error;
};

/// All that the child needs between fork and exec: there, only async-signal-safe calls are allowed, so nothing may be
/// allocated.
struct ChildPlan {
  const char* program;
  const char* folder;
  char* const* arguments;
  char* const* environment;
  int null_fd, output_fd, errors_fd, input_fd, failure_fd;
  pid_t parent;
};

[[noreturn]] void become_program(const ChildPlan& plan) {
  const auto fail = [&plan](StartFailure::Step step) {
    const StartFailure failure{step, errno};
    // Smaller than PIPE_BUF: written whole or not at all; then the parent sees exit status 127.
    [[maybe_unused]] const auto written = ::write(plan.failure_fd, &failure, sizeof failure);
    ::_exit(127);
  };
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  // The parent may have died between fork and prctl: then the signal never comes.
  if (::getppid() != plan.parent) ::_exit(127);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::signal(SIGPIPE, SIG_DFL);  // exec resets handlers, but not what is ignored
  if (::chdir(plan.folder) != 0) fail(StartFailure::kFolder);
  if (::dup2(plan.null_fd, STDIN_FILENO) < 0 || ::dup2(plan.output_fd, STDOUT_FILENO) < 0 ||
      ::dup2(plan.errors_fd, STDERR_FILENO) < 0 || (plan.input_fd >= 0 && ::dup2(plan.input_fd, kChildInput) < 0)) {
    fail(StartFailure::kDescriptors);
  }
  // A library of the calling program may have left descriptors without close-on-exec.
  const int first_extra = plan.input_fd >= 0 ? kChildInput + 1 : kChildInput;
  ::syscall(SYS_close_range, unsigned(first_extra), ~0U, CLOSE_RANGE_CLOEXEC);
  ::execve(plan.program, plan.arguments, plan.environment);
  fail(StartFailure::kExec);
  ::_exit(127);
}

/// A started process; the destructor leaves nothing of it.
class Child {
 public:
  Child(pid_t pid, UniqueFd pid_fd) : pid_(pid), pid_fd_(std::move(pid_fd)) {}
  ~Child() {
    if (!reaped_) end();
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  [[nodiscard]] int fd() const { return pid_fd_.get(); }

  /// The group before the child is reaped: until then its number, which is the group's, cannot belong to anybody else.
  void kill_group() const {
    ::kill(-pid_, SIGKILL);
    ::kill(pid_, SIGKILL);  // it may not have reached setpgid yet
  }

  /// Kills what is left of the group and reaps the child.
  int end() {
    kill_group();
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    reaped_ = true;
    return status;
  }

 private:
  pid_t pid_;
  UniqueFd pid_fd_;
  bool reaped_ = false;
};

/// Takes in what is there now; false when the other end is closed.
bool drain(int fd, std::string& into) {
  std::array<char, 65536> buffer{};
  const auto got = ::read(fd, buffer.data(), buffer.size());
  if (got > 0) into.append(buffer.data(), std::size_t(got));
  if (got == 0) return false;
  return got > 0 || errno == EAGAIN || errno == EINTR;
}

void keep_newest(std::string& errors) {
  // Trimmed at twice the size, so that a flood is not copied for every read.
  if (errors.size() > 2 * kMaxErrors) errors.erase(0, errors.size() - kMaxErrors);
}

int milliseconds_until(SteadyTime deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now()).count();
  return int(std::clamp<std::chrono::milliseconds::rep>(left, 0, std::numeric_limits<int>::max()));
}

SteadyTime deadline_after(std::chrono::nanoseconds timeout) {
  const auto now = std::chrono::steady_clock::now();
  return timeout > SteadyTime::max() - now ? SteadyTime::max() : now + timeout;
}

/// Reads until the child has ended or must be killed; kExited then stands for either way of ending by itself.
ChildResult::End watch(const Child& child, const ChildRequest& request, int output_fd, int errors_fd,
                       SteadyTime deadline, ChildResult& result) {
  std::array<pollfd, 4> fds{
      {{child.fd(), POLLIN, 0}, {request.stop_fd, POLLIN, 0}, {output_fd, POLLIN, 0}, {errors_fd, POLLIN, 0}}};
  auto& [ended, stop, output, errors] = fds;
  while (true) {
    const int ready = ::poll(fds.data(), fds.size(), milliseconds_until(deadline));
    if (ready < 0 && errno != EINTR) throw_errno("poll");
    if (ready < 0) continue;
    if (stop.revents != 0) return ChildResult::End::kStopped;
    // Something that the child left behind may hold the pipes open, or fill them: their end is not waited for.
    const bool gone = ended.revents != 0;
    if (gone) child.kill_group();
    // A closed pipe is always ready: a negative number takes it out of the set.
    if (output.revents != 0 && !drain(output_fd, result.output)) output.fd = -1;
    if (errors.revents != 0 && !drain(errors_fd, result.errors)) errors.fd = -1;
    keep_newest(result.errors);
    if (result.output.size() > request.max_output) return ChildResult::End::kTooMuch;
    if (gone && output.revents == 0 && errors.revents == 0) return ChildResult::End::kExited;
    // Checked on every turn, not only when poll times out: a child that writes without end keeps poll busy.
    if (std::chrono::steady_clock::now() >= deadline) {
      return gone ? ChildResult::End::kExited : ChildResult::End::kTimedOut;
    }
  }
}

const char* describe(int step) {
  switch (step) {
    case StartFailure::kFolder:
      return "entering the folder";
    case StartFailure::kDescriptors:
      return "arranging the descriptors";
    default:
      return "starting the program";
  }
}

ChildResult run(const ChildRequest& request) {
  const SteadyTime deadline = deadline_after(request.timeout);
  Pipe output = make_pipe();
  Pipe errors = make_pipe();
  Pipe failure = make_pipe();
  make_non_blocking(output.read.get());
  make_non_blocking(errors.read.get());
  const UniqueFd low_null(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (!low_null.valid()) throw_errno("/dev/null");
  const UniqueFd null = lifted(low_null.get());
  const UniqueFd input = request.input_fd >= 0 ? lifted(request.input_fd) : UniqueFd();

  std::vector<std::string> arguments{request.program};
  arguments.insert(arguments.end(), request.arguments.begin(), request.arguments.end());
  const auto argument_pointers = pointers(arguments);
  const auto environment_pointers = pointers(request.environment);
  const ChildPlan plan{request.program.c_str(),
                       request.folder.c_str(),
                       argument_pointers.data(),
                       environment_pointers.data(),
                       null.get(),
                       output.write.get(),
                       errors.write.get(),
                       input.get(),
                       failure.write.get(),
                       ::getpid()};
  const pid_t pid = ::fork();
  if (pid < 0) throw_errno("fork");
  if (pid == 0) become_program(plan);
  // Both sides set the group: whoever comes first. After exec it fails, and then the child has done it.
  ::setpgid(pid, pid);
  UniqueFd pid_fd(int(::syscall(SYS_pidfd_open, pid, 0U)));
  const int pid_fd_error = errno;
  const bool watchable = pid_fd.valid();
  Child child(pid, std::move(pid_fd));
  if (!watchable) throw std::system_error(pid_fd_error, std::generic_category(), "pidfd_open");

  output.write.reset();
  errors.write.reset();
  failure.write.reset();
  // Ends when exec closes the other end, at once.
  StartFailure what{};
  ssize_t got = 0;
  do {
    got = ::read(failure.read.get(), &what, sizeof what);
  } while (got < 0 && errno == EINTR);
  if (got == sizeof what) return {ChildResult::End::kNotStarted, what.error, {}, describe(what.step)};

  ChildResult result;
  result.end = watch(child, request, output.read.get(), errors.read.get(), deadline, result);
  const int status = child.end();
  if (result.errors.size() > kMaxErrors) result.errors.erase(0, result.errors.size() - kMaxErrors);
  if (result.end != ChildResult::End::kExited) return result;
  if (WIFSIGNALED(status)) {
    result.end = ChildResult::End::kSignalled;
    result.number = WTERMSIG(status);
  } else {
    result.number = WEXITSTATUS(status);
  }
  return result;
}

}  // namespace

UniqueFd& UniqueFd::operator=(UniqueFd&& other) noexcept {
  if (this != &other) {
    reset();
    std::swap(fd_, other.fd_);
  }
  return *this;
}

void UniqueFd::reset() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

UniqueFd memory_file(const char* name, const std::string& content) {
  UniqueFd fd(::memfd_create(name, MFD_CLOEXEC));
  if (!fd.valid()) throw_errno("memfd_create");
  std::size_t done = 0;
  while (done < content.size()) {
    const auto written = ::write(fd.get(), content.data() + done, content.size() - done);
    if (written < 0 && errno != EINTR) throw_errno("write");
    if (written > 0) done += std::size_t(written);
  }
  return fd;
}

StopSignal::StopSignal() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (!fd_.valid()) throw_errno("eventfd");
}

void StopSignal::raise() {
  const std::uint64_t one = 1;
  // Fails only when the counter is full: then it is raised already.
  [[maybe_unused]] const auto written = ::write(fd_.get(), &one, sizeof one);
}

ChildResult run_child(const ChildRequest& request) {
  try {
    return run(request);
  } catch (const std::system_error& e) {
    return {ChildResult::End::kNotStarted, e.code().value(), {}, e.what()};
  }
}

}  // namespace twocone::sim_povray

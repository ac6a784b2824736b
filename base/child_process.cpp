// SPDX-License-Identifier: Apache-2.0
#include "base/child_process.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <system_error>
#include <utility>

namespace twocone::base {
namespace {

namespace fs = std::filesystem;

/// Waits for a process that ends soon, because it has ended or was killed, and returns its status.
int reap(pid_t pid) noexcept {
  int status = 0;
  static_cast<void>(TEMP_FAILURE_RETRY(::waitpid(pid, &status, 0)));
  return status;
}

void make_non_blocking(int fd) {
  if (::fcntl(fd, F_SETFL, O_NONBLOCK) != 0) throw_errno("fcntl");
}

/// Returns pointers for exec; the strings must outlive them.
std::vector<char*> pointers(const std::vector<std::string>& strings) {
  std::vector<char*> result;
  result.reserve(strings.size() + 1);
  for (const auto& s : strings) result.push_back(const_cast<char*>(s.c_str()));
  result.push_back(nullptr);
  return result;
}

/// The child sends this to its parent if it cannot become the program. The text is a literal, so it has the same
/// address in both.
struct StartFailure {
  const char* step;
  int error;
};

/// Everything that the child needs between fork and exec. Only async-signal-safe calls are allowed there, so the child
/// may allocate nothing.
struct ChildPlan {
  const Program& program;
  std::vector<char*> arguments{}, environment{};
  UniqueFd input{}, output{}, errors{}, failure{}, ruleset{};
  std::vector<UniqueFd> inputs{};
  pid_t parent = ::getpid();
};

[[noreturn]] void become_program(const ChildPlan& plan) {
  const auto fail = [&plan](const char* step) {
    const StartFailure failure{step, errno};
    // The message is smaller than PIPE_BUF, so it is written whole or not at all. In the latter case the parent sees
    // exit status 127.
    [[maybe_unused]] const auto written = ::write(plan.failure.get(), &failure, sizeof failure);
    ::_exit(127);
  };
  const Program& program = plan.program;
  if (program.outlives) {
    ::setsid();  // Ctrl-C and the end of the terminal must not stop it
  } else {
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    // If the parent ended between fork and prctl, the signal never comes.
    if (::getppid() != plan.parent) ::_exit(127);
  }
  Process::unblock_signals();
  ::signal(SIGPIPE, SIG_DFL);  // exec resets handlers, but not ignored signals
  if (::chdir(program.folder.c_str()) != 0) fail("entering the folder");
  if (::dup2(plan.input.get(), STDIN_FILENO) < 0 || ::dup2(plan.output.get(), STDOUT_FILENO) < 0 ||
      ::dup2(plan.errors.get(), STDERR_FILENO) < 0) {
    fail("arranging the descriptors");
  }
  int next = kChildInput;
  for (const UniqueFd& input : plan.inputs) {
    if (::dup2(input.get(), next++) < 0) fail("arranging the descriptors");
  }
  // A library of the calling program may have left descriptors without close-on-exec.
  ::syscall(SYS_close_range, unsigned(next), ~0U, CLOSE_RANGE_CLOEXEC);
  if (program.confinement && !Confinement::enter(program.confinement->kind(), plan.ruleset.get())) {
    fail("confining the program");
  }
  ::execve(program.path.c_str(), plan.arguments.data(), plan.environment.data());
  fail("starting the program");
  ::_exit(127);
}

using SteadyTime = std::chrono::steady_clock::time_point;

SteadyTime deadline_after(std::chrono::nanoseconds timeout) {
  const auto now = std::chrono::steady_clock::now();
  return timeout > SteadyTime::max() - now ? SteadyTime::max() : now + timeout;
}

void measure(const StartedChild& child, ChildResult& result) {
  const std::uint64_t before = result.use ? result.use->peak_bytes : 0;
  if (const auto cpu = child.cpu()) result.use = {*cpu, std::max(before, base::peak_memory_bytes(child.pid()))};
}

/// Reads until the child has ended (it then returns kEnded) or must be killed.
ChildResult::End watch(const StartedChild& child, const ChildRequest& request, SteadyTime deadline,
                       ChildResult& result) {
  std::array<pollfd, 4> fds{{{child.end_fd(), POLLIN, 0},
                             {request.stop_fd, POLLIN, 0},
                             {child.output_fd(), POLLIN, 0},
                             {child.errors_fd(), POLLIN, 0}}};
  auto& [ended, stop, output, errors] = fds;
  while (true) {
    const int ready = ::poll(fds.data(), fds.size(), milliseconds_until(deadline));
    if (ready < 0 && errno != EINTR) throw_errno("poll");
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

int milliseconds_until(SteadyTime deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now()).count();
  return int(std::clamp<std::chrono::milliseconds::rep>(left, 0, std::numeric_limits<int>::max()));
}

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
    pollfd end{end_fd_.get(), POLLIN, 0};
    const int ready = ::poll(&end, 1, milliseconds_until(deadline));
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

std::uint64_t peak_memory_bytes(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string word; status >> word;) {
    std::uint64_t kibibytes = 0;
    if (word == "VmHWM:" && status >> kibibytes) return kibibytes * 1024;
  }
  return 0;
}

std::optional<std::string> find_program(const std::string& name) {
  if (name.find('/') != std::string::npos) return name;
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "/usr/local/bin:/usr/bin:/bin" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path program = fs::path(folder) / name;
    std::error_code error;
    if (fs::is_regular_file(program, error) && ::access(program.c_str(), X_OK) == 0) return program.string();
  }
  return std::nullopt;
}

std::vector<std::string> own_environment() {
  std::vector<std::string> variables;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) variables.emplace_back(*entry);
  return variables;
}

StartedChild::StartedChild(const Program& program) {
  const auto read_by = [](UniqueFd& reader) {
    Pipe pipe = make_pipe();
    make_non_blocking(pipe.read.get());
    reader = std::move(pipe.read);
    return std::move(pipe.write);
  };
  ChildPlan plan{program};
  if (program.output) plan.output = read_by(output_);
  plan.errors = read_by(errors_);
  Pipe failure = make_pipe();
  plan.failure = std::move(failure.write);
  const UniqueFd null(::open("/dev/null", O_RDWR | O_CLOEXEC));
  if (!null.valid()) throw_errno("/dev/null");
  if (!program.output) plan.output = lifted(null.get());
  plan.input = lifted(program.input < 0 ? null.get() : program.input);
  for (const int input : program.inputs) plan.inputs.push_back(lifted(input));
  if (program.confinement) {
    plan.ruleset = program.confinement->ruleset(program.writable);
    if (plan.ruleset.valid()) plan.ruleset = lifted(plan.ruleset.get());
  }
  std::vector<std::string> arguments{program.path};
  arguments.insert(arguments.end(), program.arguments.begin(), program.arguments.end());
  plan.arguments = pointers(arguments);
  plan.environment = pointers(program.environment);
  process_ = Process([&plan] { become_program(plan); });
  // Parent and child both set the group, because either may run first. After exec this call fails, but then the child
  // has set it. The leader of a group could not begin a session.
  if (!program.outlives) ::setpgid(pid(), pid());
  plan.failure.reset();
  // This read ends as soon as exec closes the other end.
  StartFailure what{};
  if (TEMP_FAILURE_RETRY(::read(failure.read.get(), &what, sizeof what)) == sizeof what) {
    throw std::system_error(what.error, std::generic_category(), what.step);
  }
}

StartedChild::~StartedChild() {
  if (pid() > 0) end();
}

std::optional<std::chrono::nanoseconds> StartedChild::cpu() const {
  clockid_t clock{};
  timespec time{};
  if (::clock_getcpuclockid(pid(), &clock) != 0 || ::clock_gettime(clock, &time) != 0) return std::nullopt;
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

void StartedChild::kill_group() const {
  ::kill(-pid(), SIGKILL);
  process_.signal(SIGKILL);  // the child may not have reached setpgid yet
}

int StartedChild::end() {
  kill_group();
  return process_.kill();
}

bool drain(int fd, std::string& into) {
  std::array<char, 65536> buffer{};
  const auto got = ::read(fd, buffer.data(), buffer.size());
  if (got > 0) into.append(buffer.data(), std::size_t(got));
  if (got == 0) return false;
  return got > 0 || errno == EAGAIN || errno == EINTR;
}

void keep_newest(std::string& errors) {
  if (errors.size() > 2 * kMaxErrors) errors.erase(0, errors.size() - kMaxErrors);
}

StopSignal::StopSignal() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (!fd_.valid()) throw_errno("eventfd");
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

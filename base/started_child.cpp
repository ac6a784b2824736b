// SPDX-License-Identifier: Apache-2.0
#include "base/started_child.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <system_error>

namespace twocone::base {
namespace {

namespace fs = std::filesystem;

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
  char* const* arguments;
  char* const* environment;
  int input_fd, output_fd, errors_fd, failure_fd;
  const std::vector<UniqueFd>& inputs;
  pid_t parent;
  int ruleset_fd;
};

[[noreturn]] void become_program(const ChildPlan& plan) {
  const auto fail = [&plan](const char* step) {
    const StartFailure failure{step, errno};
    // The message is smaller than PIPE_BUF, so it is written whole or not at all. In the latter case the parent sees
    // exit status 127.
    [[maybe_unused]] const auto written = ::write(plan.failure_fd, &failure, sizeof failure);
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
  if (::dup2(plan.input_fd, STDIN_FILENO) < 0 || ::dup2(plan.output_fd, STDOUT_FILENO) < 0 ||
      ::dup2(plan.errors_fd, STDERR_FILENO) < 0) {
    fail("arranging the descriptors");
  }
  int next = kChildInput;
  for (const UniqueFd& input : plan.inputs) {
    if (::dup2(input.get(), next++) < 0) fail("arranging the descriptors");
  }
  // A library of the calling program may have left descriptors without close-on-exec.
  ::syscall(SYS_close_range, unsigned(next), ~0U, CLOSE_RANGE_CLOEXEC);
  if (program.confinement && !Confinement::enter(program.confinement->kind(), plan.ruleset_fd)) {
    fail("confining the program");
  }
  ::execve(program.path.c_str(), plan.arguments, plan.environment);
  fail("starting the program");
  ::_exit(127);
}

}  // namespace

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
  const UniqueFd output = program.output ? read_by(output_) : UniqueFd();
  const UniqueFd errors = read_by(errors_);
  Pipe failure = make_pipe();
  const UniqueFd low_null(::open("/dev/null", O_RDWR | O_CLOEXEC));
  if (!low_null.valid()) throw_errno("/dev/null");
  const UniqueFd null = lifted(low_null.get());
  const UniqueFd standard_input = lifted(program.input < 0 ? low_null.get() : program.input);
  std::vector<UniqueFd> inputs;
  for (const int input : program.inputs) inputs.push_back(lifted(input));

  UniqueFd ruleset;
  if (program.confinement) {
    ruleset = program.confinement->ruleset(program.writable);
    if (ruleset.valid()) ruleset = lifted(ruleset.get());
  }

  std::vector<std::string> arguments{program.path};
  arguments.insert(arguments.end(), program.arguments.begin(), program.arguments.end());
  const auto argument_pointers = pointers(arguments);
  const auto environment_pointers = pointers(program.environment);
  const ChildPlan plan{program,
                       argument_pointers.data(),
                       environment_pointers.data(),
                       standard_input.get(),
                       program.output ? output.get() : null.get(),
                       errors.get(),
                       failure.write.get(),
                       inputs,
                       ::getpid(),
                       ruleset.get()};
  process_ = Process([&plan] { become_program(plan); });
  // Parent and child both set the group, because either may run first. After exec this call fails, but then the child
  // has set it. The leader of a group could not begin a session.
  if (!program.outlives) ::setpgid(pid(), pid());
  failure.write.reset();
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

}  // namespace twocone::base

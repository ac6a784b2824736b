// SPDX-License-Identifier: Apache-2.0
#include "base/scratch_folder.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <signal.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>

namespace twocone::base {
namespace {

namespace fs = std::filesystem;

/// POV-Ray processes that end together with the program may still be writing, so the janitor tries again for ten
/// seconds.
constexpr const char* kJanitor =
    "read -r x; n=0; "
    "while rm -rf -- \"$1\" 2>/dev/null; [ -e \"$1\" ] && [ $n -lt 100 ]; do n=$((n + 1)); sleep 0.1; done";

[[noreturn]] void throw_errno(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

/// Runs between fork and exec, so it uses only async-signal-safe calls.
[[noreturn]] void become_janitor(char* const* arguments, char* const* environment, int pipe_end, int null) {
  ::setsid();  // Ctrl-C and the end of the terminal must not stop the janitor
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  if (::dup2(pipe_end, STDIN_FILENO) < 0 || ::dup2(null, STDOUT_FILENO) < 0 || ::dup2(null, STDERR_FILENO) < 0 ||
      ::chdir("/") != 0) {
    ::_exit(127);
  }
  ::syscall(SYS_close_range, unsigned(STDERR_FILENO + 1), ~0U, CLOSE_RANGE_CLOEXEC);
  ::execve("/bin/sh", arguments, environment);
  ::_exit(127);
}

}  // namespace

ScratchFolder::ScratchFolder(const std::vector<fs::path>& roots) {
  errno = ENOENT;
  for (const fs::path& root : roots) {
    std::string name = (root / "twocone-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) continue;
    path_ = name;
    break;
  }
  if (path_.empty()) throw_errno("no folder for images");
  try {
    start_janitor();
  } catch (const std::system_error&) {
    ::rmdir(path_.c_str());
    throw;
  }
}

void ScratchFolder::start_janitor() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw_errno("pipe2");
  const UniqueFd read_end(::fcntl(ends[0], F_DUPFD_CLOEXEC, STDERR_FILENO + 1));
  ::close(ends[0]);
  UniqueFd write_end(ends[1]);
  const UniqueFd low_null(::open("/dev/null", O_RDWR | O_CLOEXEC));
  const UniqueFd null(::fcntl(low_null.get(), F_DUPFD_CLOEXEC, STDERR_FILENO + 1));
  if (!read_end.valid() || !null.valid()) throw_errno("/dev/null");

  std::string path = path_.string();
  std::array<std::string, 5> words{"sh", "-c", kJanitor, "twocone-janitor", path};
  const std::array<char*, 6> arguments{words[0].data(), words[1].data(), words[2].data(),
                                       words[3].data(), words[4].data(), nullptr};
  std::string search = "PATH=/usr/bin:/bin";
  const std::array<char*, 2> environment{search.data(), nullptr};
  janitor_ = ::fork();
  if (janitor_ < 0) throw_errno("fork");
  if (janitor_ == 0) become_janitor(arguments.data(), environment.data(), read_end.get(), null.get());
  alive_ = std::move(write_end);
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;  // a destructor has no caller to report it to
  fs::remove_all(path_, ignored);
  ::kill(janitor_, SIGKILL);
  while (::waitpid(janitor_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::vector<fs::path> scratch_roots() {
  std::vector<fs::path> roots;
  if (const char* runtime = std::getenv("XDG_RUNTIME_DIR"); runtime != nullptr && runtime[0] == '/') {
    roots.emplace_back(runtime);
  }
  roots.emplace_back("/dev/shm");
  roots.emplace_back("/tmp");
  return roots;
}

}  // namespace twocone::base

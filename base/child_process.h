// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/confinement.h"
#include "base/unique_fd.h"

namespace twocone::base {

/// Returns the time until then as poll() takes it: in whole milliseconds, rounded up, and 0 if it is over.
int milliseconds_until(std::chrono::steady_clock::time_point deadline);

/// A child process of this program. Every child process of the product is made here: StartedChild starts other
/// programs; the watchdog of the wheels continues in a copy of this one.
class Process {
 public:
  /// Owns no process.
  Process() = default;
  /// Forks: `body` runs in the child, which then exits with status 0. All signals are blocked there at first, so that
  /// none reaches a handler of the parent; unblock_signals() ends that. If this program has other threads, `body` may
  /// make only calls that a signal handler may make.
  /// @throws std::system_error naming the step that failed
  explicit Process(const std::function<void()>& body);
  /// Kills and reaps the process.
  ~Process();
  Process(Process&& other) noexcept;
  Process& operator=(Process&& other) noexcept;

  /// Returns the process's number; 0: none, or it is reaped.
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Returns a descriptor that becomes readable when the process has ended.
  [[nodiscard]] int end_fd() const { return end_fd_.get(); }

  /// Sends a signal. The process is not reaped yet, so its number cannot belong to another one.
  void signal(int number) const noexcept;
  /// Waits for the end for at most `timeout` and reaps the process. Returns the status of waitpid(); none: it still
  /// runs.
  std::optional<int> wait(std::chrono::milliseconds timeout) noexcept;
  /// Kills and reaps the process, and returns the status of waitpid(); 0 if there is none.
  int kill() noexcept;

  /// Unblocks all signals in the calling thread; for a child. It is async-signal-safe.
  static void unblock_signals() noexcept;

 private:
  pid_t pid_ = 0;
  UniqueFd end_fd_;
};

/// Returns the peak memory of a process since it started its program (wait4() would also count the memory of the
/// program that forked it); 0: not known, as after the process has ended.
std::uint64_t peak_memory_bytes(pid_t pid);

/// Returns the path of a program: `name` itself if it has a slash, else the one found in PATH. None: PATH has none.
std::optional<std::string> find_program(const std::string& name);

/// Returns the environment of this program, as Program::environment requires it.
std::vector<std::string> own_environment();

/// A program to start.
struct Program {
  std::string path;                                  ///< full path; PATH is not searched
  std::vector<std::string> arguments;                ///< without the program's name
  std::vector<std::string> environment;              ///< the complete environment, NAME=value
  std::string folder;                                ///< working directory
  std::vector<int> inputs;                           ///< become its descriptors kChildInput, kChildInput + 1, ...
  bool output = true;                                ///< false: its standard output goes to /dev/null
  std::shared_ptr<const Confinement> confinement{};  ///< none: it has the same rights as this program
  std::string writable{};                            ///< the folder where a program confined by Landlock may write
  int input = -1;                                    ///< becomes its standard input; -1: that is /dev/null
  bool outlives = false;  ///< it has its own session, and the kernel does not kill it when this program ends
};
constexpr int kChildInput = 3;

/// A started program. It inherits no descriptor but its inputs, and it has its own process group. Unless it may outlive
/// this program, the kernel kills it if the *thread* that started it ends in any way. (This does not cover processes
/// that it starts itself: kill -9 of this program leaves a grandchild behind. POV-Ray starts none.)
class StartedChild {
 public:
  /// @throws std::system_error whose what() names the step that failed
  explicit StartedChild(const Program& program);
  /// Kills and reaps the child.
  ~StartedChild();
  StartedChild(const StartedChild&) = delete;
  StartedChild& operator=(const StartedChild&) = delete;

  [[nodiscard]] pid_t pid() const { return process_.pid(); }
  /// Returns a descriptor that becomes readable when the child has ended.
  [[nodiscard]] int end_fd() const { return process_.end_fd(); }
  /// Returns its standard output and error as descriptors that do not block; -1 if the output is not wanted.
  [[nodiscard]] int output_fd() const { return output_.get(); }
  [[nodiscard]] int errors_fd() const { return errors_.get(); }

  /// Returns the processor time of all its threads so far, also after its end. None: the system does not report it.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> cpu() const;

  /// Kills the whole process group. Call this before the child is reaped: until then its number, which is also the
  /// group's, cannot belong to another process.
  void kill_group() const;
  /// Kills the rest of the group, reaps the child and returns the status of waitpid(). Call it only once.
  int end();

 private:
  Process process_;
  UniqueFd output_;
  UniqueFd errors_;
};

/// Appends the bytes that are available now to `into`; returns false when the other end is closed.
bool drain(int fd, std::string& into);

/// At most this many of the newest bytes of standard error are kept.
constexpr std::size_t kMaxErrors = std::size_t{64} * 1024;
/// Cuts `errors` only at twice that size, so that large output is not copied at every read.
void keep_newest(std::string& errors);

/// A descriptor to wait on. It is ready from raise() to lower(). Every method may be called from any thread.
class StopSignal {
 public:
  /// @throws std::system_error
  StopSignal();
  void raise();
  void lower();
  [[nodiscard]] int fd() const { return fd_.get(); }

 private:
  UniqueFd fd_;
};

/// The resources that a process used.
struct ProcessUse {
  std::chrono::nanoseconds cpu{0};  ///< processor time of all its threads
  std::uint64_t peak_bytes = 0;     ///< peak memory; 0: not known
};

struct ChildRequest {
  Program program;
  std::size_t max_output = 0;           ///< bytes of standard output after which the child is killed
  std::chrono::nanoseconds timeout{0};  ///< time after which the child is killed
  int stop_fd = -1;                     ///< the child is killed when this becomes readable; -1: none
  bool measured = false;                ///< true: ChildResult::use is filled in
};

struct ChildResult {
  enum class End {
    kEnded,       ///< the child ended by itself; `wait_status` holds how
    kTimedOut,    ///< killed: it took too long
    kStopped,     ///< killed: stop_fd became readable
    kTooMuch,     ///< killed: it wrote more than max_output
    kNotStarted,  ///< `errors` holds the failed step and the reason
  };
  End end = End::kNotStarted;
  int wait_status = 0;  ///< as waitpid() reports it
  std::string output;
  std::string errors;
  /// Use of a child that has ended. The memory is as of its last output. None: not requested, or not reported by the
  /// system.
  std::optional<ProcessUse> use{};
};

/// Runs a program to its end. When this returns, the child is reaped and every process that stayed in its process group
/// is gone.
ChildResult run_child(const ChildRequest& request);

}  // namespace twocone::base

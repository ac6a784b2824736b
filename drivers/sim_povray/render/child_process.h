// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

namespace twocone::sim_povray {

/// Owns a file descriptor.
class UniqueFd {
 public:
  UniqueFd() = default;
  explicit UniqueFd(int fd) : fd_(fd) {}
  UniqueFd(UniqueFd&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  UniqueFd& operator=(UniqueFd&& other) noexcept;
  UniqueFd(const UniqueFd&) = delete;
  UniqueFd& operator=(const UniqueFd&) = delete;
  ~UniqueFd() { reset(); }

  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool valid() const { return fd_ >= 0; }
  void reset();

 private:
  int fd_ = -1;
};

/// A file in memory that holds `content`. @throws std::system_error
UniqueFd memory_file(const char* name, const std::string& content);

/// A descriptor to wait on that is not ready until raise() is called. Any thread.
class StopSignal {
 public:
  /// @throws std::system_error
  StopSignal();
  void raise();
  [[nodiscard]] int fd() const { return fd_.get(); }

 private:
  UniqueFd fd_;
};

struct ChildRequest {
  std::string program;                   ///< a path: no look-up in PATH
  std::vector<std::string> arguments;    ///< without the program's name
  std::vector<std::string> environment;  ///< all of it, NAME=value
  std::string folder;                    ///< to work in
  int input_fd = -1;                     ///< what the child finds as descriptor kChildInput
  std::size_t max_output = 0;            ///< bytes of standard output after which the child is killed
  std::chrono::nanoseconds timeout{0};   ///< after which it is killed
  int stop_fd = -1;                      ///< it is killed when this gets readable; -1: none
};
constexpr int kChildInput = 3;
/// Of standard error the newest bytes are kept, this many at most.
constexpr std::size_t kMaxErrors = std::size_t{64} * 1024;

struct ChildResult {
  enum class End {
    kExited,      ///< by itself; `number` is the exit status
    kSignalled,   ///< by a signal that was not ours; `number` is the signal
    kTimedOut,    ///< killed: it took too long
    kStopped,     ///< killed: stop_fd said so
    kTooMuch,     ///< killed: it wrote more than max_output
    kNotStarted,  ///< `number` is errno, `errors` says at what
  };
  End end = End::kNotStarted;
  int number = 0;
  std::string output;
  std::string errors;
};

/// Runs a program to its end. When this returns, the child and all that stayed in its process group are gone and
/// reaped. The child reads nothing (/dev/null), inherits no descriptor but 0 to 3, stands in a process group of its
/// own, and is killed by the kernel if the calling *thread* ends, however it ends. (What the child itself starts is
/// not: kill -9 of this program leaves a grandchild behind. POV-Ray starts none.)
ChildResult run_child(const ChildRequest& request);

}  // namespace twocone::sim_povray

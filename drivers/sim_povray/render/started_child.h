// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/sim_povray/render/confinement.h"
#include "drivers/sim_povray/render/unique_fd.h"

namespace twocone::sim_povray {

/// A file in memory that holds `content`. @throws std::system_error
UniqueFd memory_file(const char* name, const std::string& content);
/// The same, which nobody can change any more. @throws std::system_error
UniqueFd sealed_file(const char* name, const std::string& content);

/// A program to start.
struct Program {
  std::string path;                                  ///< no look-up in PATH
  std::vector<std::string> arguments;                ///< without the program's name
  std::vector<std::string> environment;              ///< all of it, NAME=value
  std::string folder;                                ///< to work in
  std::vector<int> inputs;                           ///< what it finds as descriptors kChildInput, kChildInput + 1, ...
  bool output = true;                                ///< its standard output is wanted; else it goes to /dev/null
  std::shared_ptr<const Confinement> confinement{};  ///< none: it may do what this program may
  std::string writable{};                            ///< the folder in which one confined by Landlock may write
};
constexpr int kChildInput = 3;

/// A started program. It reads nothing (/dev/null), inherits no descriptor but its inputs, stands in a process group of
/// its own, and is killed by the kernel if the *thread* that started it ends, however it ends. (What it starts itself
/// is not: kill -9 of this program leaves a grandchild behind. POV-Ray starts none.)
class StartedChild {
 public:
  /// @throws std::system_error whose what() says at which step
  explicit StartedChild(const Program& program);
  /// Kills and reaps it.
  ~StartedChild();
  StartedChild(const StartedChild&) = delete;
  StartedChild& operator=(const StartedChild&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Gets readable when it has ended.
  [[nodiscard]] int end_fd() const { return pid_fd_.get(); }
  /// Its standard output and error; they do not block. -1 where it is not wanted.
  [[nodiscard]] int output_fd() const { return output_.get(); }
  [[nodiscard]] int errors_fd() const { return errors_.get(); }

  /// Processor time that all its threads have taken so far, also once it has ended. None: the system does not tell.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> cpu() const;
  /// Most memory that it has held so far as the program that it is now (wait4() would count this program's, from
  /// between fork and exec); 0: not known, as once it has ended.
  [[nodiscard]] std::uint64_t peak_bytes() const;

  /// The whole group. To be done before the child is reaped: until then its number, which is the group's, cannot belong
  /// to anybody else.
  void kill_group() const;
  /// Kills what is left of the group and reaps the child. What waitpid() says. Once only.
  int end();

 private:
  pid_t pid_ = -1;
  UniqueFd pid_fd_;
  UniqueFd output_;
  UniqueFd errors_;
};

/// Appends what is there now to `into`; false when the other end is closed.
bool drain(int fd, std::string& into);

/// Of standard error the newest bytes are kept, this many at most.
constexpr std::size_t kMaxErrors = std::size_t{64} * 1024;
/// Cuts at twice that size, so that a flood is not copied for every read.
void keep_newest(std::string& errors);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace twocone::base {

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

/// Throws the present errno. @throws std::system_error; `what` names the call or the file
[[noreturn]] void throw_errno(const char* what);

/// A pipe. A started program does not inherit its ends, and neither end is a standard stream, even if those are closed.
struct Pipe {
  UniqueFd read;
  UniqueFd write;
};
/// Makes a pipe. @throws std::system_error
Pipe make_pipe();

/// Returns a duplicate with the properties of a pipe's ends. @throws std::system_error
UniqueFd lifted(int fd);

/// Makes a file in memory that holds `content`. @throws std::system_error
UniqueFd memory_file(const char* name, const std::string& content);
/// Makes such a file and seals it: nobody can change it afterwards. @throws std::system_error
UniqueFd sealed_file(const char* name, const std::string& content);

}  // namespace twocone::base

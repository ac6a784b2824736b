// SPDX-License-Identifier: Apache-2.0
#include "apps/twocone/standard_streams.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

namespace twocone::cli {

void open_missing_streams() noexcept {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) >= 0 || errno != EBADF) continue;
    // open() returns the lowest free number, which is this one. Standard input is opened for writing and the others for
    // reading, so that each use fails.
    static_cast<void>(::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
}

void say(const std::string& line) noexcept {
  std::fputs(line.c_str(), stderr);
  std::fputc('\n', stderr);
}

std::string lost_output() {
  errno = 0;
  for (const auto& [stream, name] : {std::pair{stdout, "output"}, std::pair{stderr, "error"}}) {
    if (std::fflush(stream) == 0 && std::ferror(stream) == 0) continue;
    const std::string why = errno == 0 ? "" : std::string(": ") + std::strerror(errno);
    return std::string("cannot write to standard ") + name + why;
  }
  return "";
}

}  // namespace twocone::cli

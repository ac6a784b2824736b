// SPDX-License-Identifier: Apache-2.0
#include "base/unique_fd.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

namespace twocone::base {
namespace {

/// Above every number that a started program gives its own descriptors, so that arranging these overwrites none.
constexpr int kFirstSafeFd = 10;

UniqueFd filled_file(const char* name, const std::string& content, unsigned flags) {
  UniqueFd fd(::memfd_create(name, MFD_CLOEXEC | flags));
  if (!fd.valid()) throw_errno("memfd_create");
  std::size_t done = 0;
  while (done < content.size()) {
    const auto written = ::write(fd.get(), content.data() + done, content.size() - done);
    if (written < 0 && errno != EINTR) throw_errno("write");
    if (written > 0) done += std::size_t(written);
  }
  return fd;
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

void throw_errno(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

UniqueFd lifted(int fd) {
  UniqueFd high(::fcntl(fd, F_DUPFD_CLOEXEC, kFirstSafeFd));
  if (!high.valid()) throw_errno("fcntl");
  return high;
}

Pipe make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw_errno("pipe2");
  const UniqueFd low_read(ends[0]);
  const UniqueFd low_write(ends[1]);
  return {lifted(low_read.get()), lifted(low_write.get())};
}

UniqueFd memory_file(const char* name, const std::string& content) { return filled_file(name, content, 0); }

UniqueFd sealed_file(const char* name, const std::string& content) {
  UniqueFd fd = filled_file(name, content, MFD_ALLOW_SEALING);
  if (::fcntl(fd.get(), F_ADD_SEALS, F_SEAL_SEAL | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE) != 0) {
    throw_errno("sealing a memory file");
  }
  return fd;
}

}  // namespace twocone::base

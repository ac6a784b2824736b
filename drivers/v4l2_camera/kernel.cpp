// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>

#include "base/log.h"
#include "drivers/v4l2_camera/device.h"

namespace twocone::v4l2 {
namespace {

namespace fs = std::filesystem;

/// Returns false if no data has arrived yet, a list ends, or the device does not have the call.
bool is_failure(unsigned long request, int error) {
  return error != EAGAIN && error != EINVAL && error != ENOTTY && (request != VIDIOC_DQEVENT || error != ENOENT);
}

class RealKernel final : public Kernel {
 public:
  int open(const char* path) override { return int(TEMP_FAILURE_RETRY(::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC))); }
  int close(int file) override { return ::close(file); }
  int ioctl(int file, unsigned long request, void* argument) override {
    const int result = int(TEMP_FAILURE_RETRY(::ioctl(file, request, argument)));
    if (result >= 0 || !is_failure(request, errno)) return result;
    const int error = errno;
    base::Logger("v4l2").warning(fmt::format("{}: call {} of linux/videodev2.h: {}",
                                             target(fmt::format("/proc/self/fd/{}", file)), _IOC_NR(request),
                                             std::strerror(error)));
    errno = error;
    return result;
  }
  void* mmap(int file, std::size_t length, long offset) override {
    void* const memory = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, file, offset);
    // Otherwise a child that is forked later (such as the watchdog of the wheels) would keep the device's buffers.
    if (memory != MAP_FAILED) ::madvise(memory, length, MADV_DONTFORK);
    return memory;
  }
  int munmap(void* memory, std::size_t length) override { return ::munmap(memory, length); }
  int poll(pollfd& entry, int timeout_ms) override { return ::poll(&entry, 1, timeout_ms); }

  int detach(void* memory, std::size_t length) override {
    void* const copy = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (copy == MAP_FAILED) return -1;
    std::memcpy(copy, memory, length);
    // One call replaces the mapping, so that a thread that reads there meanwhile never finds it unmapped.
    if (::mremap(copy, length, length, MREMAP_MAYMOVE | MREMAP_FIXED, memory) != MAP_FAILED) return 0;
    const int error = errno;
    ::munmap(copy, length);
    errno = error;
    return -1;
  }

  std::vector<std::string> entries(const std::string& folder) override {
    std::vector<std::string> paths;
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
      paths.push_back(at->path());
    }
    return paths;
  }

  std::string target(const std::string& path) override {
    std::error_code error;
    const fs::path end = fs::canonical(path, error);
    return error ? path : end.string();
  }
};

}  // namespace

std::shared_ptr<Kernel> real_kernel() {
  static const auto kernel = std::make_shared<RealKernel>();
  return kernel;
}

}  // namespace twocone::v4l2

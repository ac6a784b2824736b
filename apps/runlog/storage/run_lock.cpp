// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/run_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/results_exchange.h"

namespace twocone::runlog {
namespace {

/// Returns the process number that the holder wrote, or 0 if it cannot be read.
long holder_of(int descriptor) {
  std::array<char, 24> text{};
  if (::pread(descriptor, text.data(), text.size() - 1, 0) <= 0) return 0;
  return std::strtol(text.data(), nullptr, 10);
}

/// Returns false if another folder has replaced this one since its file was opened.
bool is_still(int descriptor, const std::filesystem::path& file) {
  struct stat opened {};
  struct stat there {};
  return ::fstat(descriptor, &opened) == 0 && ::stat(file.c_str(), &there) == 0 && opened.st_ino == there.st_ino &&
         opened.st_dev == there.st_dev;
}

struct Attempt {
  int descriptor = -1;  ///< >= 0: this program holds the lock
  std::string why_not;
};

Attempt attempt(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / RunLock::kFileName;
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0) return {-1, fmt::format("cannot write {}: {}", file.string(), std::strerror(errno))};
  const bool locked = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
  if (!locked || !is_still(descriptor, file)) {
    const int error = locked ? EWOULDBLOCK : errno;
    std::string why_not = fmt::format("cannot lock {}: {}", file.string(), std::strerror(error));
    if (error == EWOULDBLOCK) {
      const long holder = holder_of(descriptor);
      why_not =
          fmt::format("{} is being written by another program{}: wait until that has ended, or choose another folder",
                      folder.string(), holder > 0 ? fmt::format(" (process {})", holder) : "");
    }
    ::close(descriptor);
    return {-1, std::move(why_not)};
  }
  const std::string holder = fmt::format("{}\n", ::getpid());
  // The number is only for messages, so a full disk does not prevent the lock.
  if (::ftruncate(descriptor, 0) == 0) (void)!::pwrite(descriptor, holder.data(), holder.size(), 0);
  return {descriptor, {}};
}

}  // namespace

RunLock::RunLock(const std::filesystem::path& folder) : descriptor_(-1) {
  Attempt tried = attempt(folder);
  if (tried.descriptor < 0) throw DiskError(tried.why_not);
  RunLock taken(tried.descriptor);  // releases the lock if the next line throws
  complete_exchanges(folder);
  std::swap(descriptor_, taken.descriptor_);
}

RunLock::~RunLock() {
  if (descriptor_ < 0) return;
  (void)!::ftruncate(descriptor_, 0);  // equal runs must have equal files
  ::close(descriptor_);
}

RunLock::RunLock(RunLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

std::optional<RunLock> RunLock::try_take(const std::filesystem::path& folder) {
  const Attempt tried = attempt(folder);
  if (tried.descriptor < 0) return std::nullopt;
  RunLock taken(tried.descriptor);
  complete_exchanges(folder);
  return taken;
}

}  // namespace twocone::runlog

// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/server/shared_frames.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cassert>
#include <cerrno>
#include <fstream>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/server/socket.h"

namespace twocone::sim_povray::server {
namespace {

/// No program can shrink the file below a reader, or grow it, or remove these seals.
constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;

/// Returns the memory that the kernel estimates to be available without swapping; the greatest number if it does not
/// report that.
std::uint64_t free_memory_bytes() {
  std::ifstream file("/proc/meminfo");
  for (std::string key, rest; file >> key; std::getline(file, rest)) {
    std::uint64_t kib = 0;
    if (key == "MemAvailable:" && file >> kib) return kib * 1024;
  }
  return std::numeric_limits<std::uint64_t>::max();
}

/// Returns the limit beyond which growing a file raises a signal.
std::uint64_t file_size_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) {
    return std::numeric_limits<std::uint64_t>::max();
  }
  return limit.rlim_cur;
}

Error no_memory(std::uint32_t slots, std::uint64_t bytes, const std::string& why) {
  return {ErrorCode::kUnavailable,
          fmt::format("no shared memory for {} images ({:.1f} MB): {}", slots, double(bytes) / 1e6, why)};
}

}  // namespace

Result<SharedFrames> SharedFrames::allocate(std::uint32_t slots, std::uint64_t slot_bytes) {
  const std::uint64_t bytes = slots * slot_bytes;
  // Checked first: if the memory gets full, the kernel kills a program before it reports an error.
  if (const auto available = free_memory_bytes(); bytes > available) {
    return no_memory(slots, bytes, fmt::format("{:.1f} MB are free", double(available) / 1e6));
  }
  if (const auto limit = file_size_limit(); bytes > limit) {
    return no_memory(slots, bytes, fmt::format("a file may have {:.1f} MB (ulimit -f)", double(limit) / 1e6));
  }
  base::UniqueFd file(::memfd_create("twocone frames", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!file.valid()) return no_memory(slots, bytes, words(errno));
  int failed = 0;
  do failed = ::fallocate(file.get(), 0, 0, static_cast<off_t>(bytes)) == 0 ? 0 : errno;
  while (failed == EINTR);
  if (failed != 0) return no_memory(slots, bytes, words(failed));
  if (::fcntl(file.get(), F_ADD_SEALS, kSeals) != 0) return no_memory(slots, bytes, words(errno));
  void* memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), 0);
  if (memory == MAP_FAILED) return no_memory(slots, bytes, words(errno));
  return SharedFrames(std::move(file), memory, slots, slot_bytes);
}

Result<SharedFrames> SharedFrames::adopt(base::UniqueFd file, std::uint32_t slots, std::uint64_t slot_bytes) {
  const std::uint64_t bytes = slots * slot_bytes;
  struct stat status {};
  if (bytes == 0 || ::fstat(file.get(), &status) != 0 || std::uint64_t(status.st_size) != bytes) {
    return Error{ErrorCode::kBadData, fmt::format("the shared memory that came does not hold {} bytes", bytes)};
  }
  const int seals = ::fcntl(file.get(), F_GET_SEALS);
  if (seals < 0 || (seals & kSeals) != kSeals) {
    return Error{ErrorCode::kBadData, "the shared memory that came is not sealed"};
  }
  void* memory = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, file.get(), 0);
  if (memory == MAP_FAILED) return no_memory(slots, bytes, words(errno));
  return SharedFrames(base::UniqueFd(), memory, slots, slot_bytes);
}

void SharedFrames::Unmap::operator()(std::uint8_t* memory) const { ::munmap(memory, bytes); }

std::span<std::uint8_t> SharedFrames::bytes_of(std::uint32_t slot) const {
  assert(slot < slots_);
  return {memory_.get() + slot * slot_bytes_, slot_bytes_};
}

}  // namespace twocone::sim_povray::server

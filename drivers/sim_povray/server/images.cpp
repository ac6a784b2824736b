// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/server/images.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <exception>
#include <fstream>
#include <iterator>
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
  return Error(ErrorCode::kUnavailable, "no shared memory for {} images ({:.1f} MB): {}", slots, double(bytes) / 1e6,
               why);
}

/// It is not possible to wait for several futures, so one is awaited for this time, and then all are checked.
constexpr std::chrono::milliseconds kImageSlice{5};

ImageResult result_of(const std::shared_future<ImageResult>& image) {
  try {
    return image.get();
  } catch (const std::exception& error) {  // a promise that was dropped
    return Error(ErrorCode::kDisconnected, "the image was given up: {}", error.what());
  }
}

}  // namespace

Result<SharedFrames> SharedFrames::allocate(std::uint32_t slots, std::uint64_t slot_bytes) {
  const std::uint64_t bytes = slots * slot_bytes;
  // The check comes first: if the memory gets full, the kernel kills a program before it reports an error.
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
    return Error(ErrorCode::kBadData, "the shared memory that came does not hold {} bytes", bytes);
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

bool ImageSlots::occupy(std::uint32_t slot) {
  const std::lock_guard lock(mutex_);
  assert(slot < busy_.size());
  if (busy_[slot]) return false;
  busy_[slot] = true;
  return true;
}

void ImageSlots::release(std::uint32_t slot) {
  const std::lock_guard lock(mutex_);
  busy_[slot] = false;
}

bool ImageSlots::is_any_busy() {
  const std::lock_guard lock(mutex_);
  return std::find(busy_.begin(), busy_.end(), true) != busy_.end();
}

Status ImageSlots::write(std::uint32_t slot, const Image& image) {
  const std::span<std::uint8_t> room = frames_.write(slot);
  if (image.width_px != size_.width_px || image.height_px != size_.height_px ||
      image.bytes.size() != image_bytes(image.format, image.width_px, image.height_px) ||
      image.bytes.size() > room.size()) {
    return Error(ErrorCode::kBadData, "the image is of {} x {} pixels, {} x {} were asked for", image.width_px,
                 image.height_px, size_.width_px, size_.height_px);
  }
  std::copy(image.bytes.begin(), image.bytes.end(), room.begin());
  return {};
}

ImageSender::ImageSender(int socket) : socket_(socket), thread_([this] { work(); }) {}

ImageSender::~ImageSender() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void ImageSender::add(Order order) {
  {
    const std::lock_guard lock(mutex_);
    added_.push_back(std::move(order));
  }
  changed_.notify_all();
}

void ImageSender::work() {
  std::vector<Order> waiting;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      // The destructor ends this wait; the time limit only prevents a wait without an end.
      if (waiting.empty())
        changed_.wait_for(lock, std::chrono::seconds(1), [this] { return stopping_ || !added_.empty(); });
      if (stopping_) return;
      std::move(added_.begin(), added_.end(), std::back_inserter(waiting));
      added_.clear();
    }
    if (waiting.empty()) continue;
    waiting.front().image.wait_for(kImageSlice);
    for (auto order = waiting.begin(); order != waiting.end();) {
      if (order->image.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
        ++order;
        continue;
      }
      if (!deliver(*order)) {
        ::shutdown(socket_, SHUT_RDWR);
        return;
      }
      order = waiting.erase(order);
    }
  }
}

bool ImageSender::deliver(const Order& order) const {
  const ImageResult image = result_of(order.image);
  const Status written = image ? order.slots->write(order.slot, **image) : Status(image.error());
  // The slot is released before the notification, because the client may use it again immediately.
  order.slots->release(order.slot);
  const Message message = written ? Message(ImageDone{order.order, (*image)->format})
                                  : ImageFailed{order.order, written.error().code, written.error().message};
  return send_message(socket_, message, in(kSendTime)).has_value();
}

}  // namespace twocone::sim_povray::server

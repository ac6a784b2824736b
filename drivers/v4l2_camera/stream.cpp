// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2_camera/device.h"

#include <sys/mman.h>

#include <algorithm>
#include <cerrno>

#include <fmt/format.h>

namespace twocone::v4l2 {
namespace {

// Two buffers are for the device, two for the program that reads, and two for late readers (latency_frames).
constexpr std::uint32_t kBuffers = 6;
constexpr std::uint32_t kLeastBuffers = 2;
// A 32-bit difference of more than half the range is a step backwards.
constexpr std::uint32_t kBackwards = 1U << 31;

}  // namespace

/// A v4l2_buffer with one plane or none.
struct Stream::Request {
  explicit Request(std::uint32_t type, std::uint32_t index = 0) {
    buffer.type = type;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    if (has_planes()) {
      buffer.m.planes = &plane;
      buffer.length = 1;
    }
  }
  Request(const Request&) = delete;
  Request& operator=(const Request&) = delete;
  [[nodiscard]] bool has_planes() const { return buffer.type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }
  [[nodiscard]] std::size_t length() const { return has_planes() ? plane.length : buffer.length; }
  [[nodiscard]] std::size_t used() const { return has_planes() ? plane.bytesused : buffer.bytesused; }
  [[nodiscard]] std::size_t offset() const { return has_planes() ? plane.data_offset : 0; }
  [[nodiscard]] std::uint32_t place() const { return has_planes() ? plane.m.mem_offset : buffer.m.offset; }

  v4l2_buffer buffer{};
  v4l2_plane plane{};
};

Result<std::shared_ptr<Stream>> Stream::start(const Device& device) {
  std::shared_ptr<Stream> stream(new Stream(device.kernel(), device.file(), device.buffer_type()));
  v4l2_requestbuffers wanted{};
  wanted.count = kBuffers;
  wanted.type = device.buffer_type();
  wanted.memory = V4L2_MEMORY_MMAP;
  if (const int error = device.call(VIDIOC_REQBUFS, &wanted)) {
    return device_error(fmt::format("{}: its buffers", device.path()), error);
  }
  // From here on, stop() releases the buffers.
  const auto failed = [&](const std::string& what, int error) {
    stream->stop();
    return device_error(fmt::format("{}: {}", device.path(), what), error);
  };
  if (wanted.count < kLeastBuffers) return failed("its buffers", ENOMEM);
  for (std::uint32_t i = 0; i < wanted.count; ++i) {
    Request request(device.buffer_type(), i);
    if (const int error = device.call(VIDIOC_QUERYBUF, &request.buffer)) return failed("its buffers", error);
    void* memory = device.kernel()->mmap(device.file(), request.length(), long(request.place()));
    if (memory == MAP_FAILED) return failed("its buffers' memory", errno);
    stream->buffers_.push_back({memory, request.length()});
  }
  for (std::uint32_t i = 0; i < wanted.count; ++i) {
    if (const int error = stream->queue(i)) return failed("handing it a buffer", error);
  }
  auto type = int(device.buffer_type());
  if (const int error = device.call(VIDIOC_STREAMON, &type)) return failed("starting its stream", error);
  stream->running_ = true;
  return stream;
}

Stream::~Stream() {
  for (Buffer& buffer : buffers_) unmap(buffer);
}

/// Hands a buffer to the device. Returns errno, or 0 for success.
int Stream::queue(std::uint32_t index) {
  Request request(type_, index);
  const int error = kernel_->ioctl(file_, VIDIOC_QBUF, &request.buffer) == 0 ? 0 : errno;
  buffers_[index].place = error == 0 ? Place::kDevice : Place::kRefused;
  return error;
}

void Stream::unmap(Buffer& buffer) {
  if (buffer.memory != nullptr) kernel_->munmap(buffer.memory, buffer.length);
  buffer.memory = nullptr;
  buffer.place = Place::kHere;
}

/// Returns the number of the exposure; it continues when the device's 32-bit counter wraps. If the device does not
/// count, or starts its count again, no loss is assumed.
std::uint64_t Stream::count(std::uint32_t sequence) {
  if (last_sequence_) {
    const std::uint32_t step = sequence - *last_sequence_;
    exposures_ += step == 0 || step > kBackwards ? 1 : step;
  }
  last_sequence_ = sequence;
  return exposures_;
}

Result<std::optional<Filled>> Stream::take() {
  const std::lock_guard lock(mutex_);
  for (std::uint32_t i = 0; i < buffers_.size(); ++i) {
    if (buffers_[i].place == Place::kRefused) queue(i);
  }
  Request request(type_);
  if (kernel_->ioctl(file_, VIDIOC_DQBUF, &request.buffer) != 0) {
    if (errno == EAGAIN) return std::optional<Filled>();
    // Whatever the code is, no more frames will come.
    return Error{ErrorCode::kDisconnected, device_error("its stream broke", errno).message};
  }
  const v4l2_buffer& buffer = request.buffer;
  if (buffer.index >= buffers_.size()) {
    return Error(ErrorCode::kDisconnected, "its stream broke: it has no buffer {}", buffer.index);
  }
  Buffer& shared = buffers_[buffer.index];
  shared.place = Place::kHere;
  Filled filled;
  filled.index = buffer.index;
  const std::size_t used = std::min(request.used(), shared.length);
  const std::size_t offset = std::min(request.offset(), used);
  filled.bytes = {static_cast<const std::uint8_t*>(shared.memory) + offset, used - offset};
  filled.sequence = count(buffer.sequence);
  filled.captured = std::chrono::seconds(buffer.timestamp.tv_sec) + std::chrono::microseconds(buffer.timestamp.tv_usec);
  filled.is_monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  filled.is_damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  return std::optional(filled);
}

void Stream::give_back(std::uint32_t index) {
  const std::lock_guard lock(mutex_);
  if (running_) {
    queue(index);
  } else {
    unmap(buffers_[index]);
  }
}

std::shared_ptr<const void> Stream::lend(std::uint32_t index) {
  void* const memory = buffers_[index].memory;
  {
    const std::lock_guard lock(mutex_);
    buffers_[index].place = Place::kLent;
  }
  return {memory, [stream = shared_from_this(), index](const void*) { stream->give_back(index); }};
}

std::size_t Stream::queued() const {
  const std::lock_guard lock(mutex_);
  return std::size_t(std::ranges::count(buffers_, Place::kDevice, &Buffer::place));
}

bool Stream::stop() {
  const std::lock_guard lock(mutex_);
  running_ = false;
  auto type = int(type_);
  kernel_->ioctl(file_, VIDIOC_STREAMOFF, &type);
  for (Buffer& buffer : buffers_) {
    // A mapping of the device's memory keeps the device open, and an open device cannot come back. So lent frames get
    // their own memory.
    if (buffer.place == Place::kLent) {
      kernel_->detach(buffer.memory, buffer.length);
    } else {
      unmap(buffer);
    }
  }
  v4l2_requestbuffers none{};
  none.type = type_;
  none.memory = V4L2_MEMORY_MMAP;
  return kernel_->ioctl(file_, VIDIOC_REQBUFS, &none) == 0;
}

}  // namespace twocone::v4l2

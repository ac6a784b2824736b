// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "drivers/v4l2_camera/device.h"

namespace twocone::v4l2 {

/// A filled buffer, which the device does not use until it is given back.
struct Filled {
  std::uint32_t index = 0;
  std::span<const std::uint8_t> bytes;
  std::uint64_t sequence = 0;            ///< number of the exposure since the stream's first buffer, which has 0
  std::chrono::nanoseconds captured{0};  ///< on the monotonic clock, if `is_monotonic`
  bool is_monotonic = false;
  bool is_damaged = false;
};

/// A running stream: the buffers that program and device share. Lent frames keep it alive and give their buffers back
/// from any thread. After stop() they keep only their memory, which no longer belongs to the device.
class Stream : public std::enable_shared_from_this<Stream> {
 public:
  /// Errors: kRefused, kUnavailable, kDisconnected.
  static Result<std::shared_ptr<Stream>> start(const Device& device);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// Takes a filled buffer without a wait; nothing: none is filled. Errors: kDisconnected (the stream is broken).
  Result<std::optional<Filled>> take();
  void give_back(std::uint32_t index);
  /// Keeps a buffer's bytes valid as long as a copy of the result exists; then gives the buffer back.
  std::shared_ptr<const void> lend(std::uint32_t index);
  /// The number of buffers that the device has, to fill or filled and not yet taken.
  [[nodiscard]] std::size_t queued() const;

  /// Returns true if the device's buffers are freed. Otherwise the device must be opened again before the next start.
  bool stop();

 private:
  Stream(std::shared_ptr<Kernel> kernel, int file, std::uint32_t type)
      : kernel_(std::move(kernel)), file_(file), type_(type) {}

  enum class Place {
    kHere,
    kDevice,
    kLent,
    kRefused,  ///< the device did not accept it; it is offered again
  };
  struct Buffer {
    void* memory = nullptr;  ///< null: no longer mapped
    std::size_t length = 0;
    Place place = Place::kHere;
  };
  struct Request;

  int queue(std::uint32_t index);
  void unmap(Buffer& buffer);
  std::uint64_t count(std::uint32_t sequence);

  const std::shared_ptr<Kernel> kernel_;
  const int file_;
  const std::uint32_t type_;
  mutable std::mutex mutex_;
  bool running_ = false;
  std::vector<Buffer> buffers_;
  std::optional<std::uint32_t> last_sequence_;
  std::uint64_t exposures_ = 0;
};

}  // namespace twocone::v4l2

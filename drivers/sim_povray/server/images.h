// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "base/unique_fd.h"
#include "hal/camera.h"
#include "hal/image.h"
#include "hal/result.h"

/// The images of a link, in memory that both programs share, and their transfer on the server's side.
namespace twocone::sim_povray::server {

/// Memory for images that two programs share: an anonymous file that the kernel frees with its last user, sealed
/// against any change of its size, so that an access cannot fail.
class SharedFrames {
 public:
  /// Makes memory to write into. All of it is allocated when this returns. Errors: kUnavailable (no memory is
  /// available).
  static Result<SharedFrames> allocate(std::uint32_t slots, std::uint64_t slot_bytes);
  /// Opens memory that allocate() made elsewhere, to read from. Errors: kBadData (another size, or not sealed).
  static Result<SharedFrames> adopt(base::UniqueFd file, std::uint32_t slots, std::uint64_t slot_bytes);

  [[nodiscard]] std::uint32_t slots() const { return slots_; }
  [[nodiscard]] std::span<const std::uint8_t> read(std::uint32_t slot) const { return bytes_of(slot); }
  /// Requires an object that allocate() returned.
  [[nodiscard]] std::span<std::uint8_t> write(std::uint32_t slot) { return bytes_of(slot); }

  /// Returns the descriptor to pass on; the memory stays without it.
  [[nodiscard]] base::UniqueFd take_file() { return std::move(file_); }

 private:
  struct Unmap {
    std::size_t bytes;
    void operator()(std::uint8_t* memory) const;
  };

  SharedFrames(base::UniqueFd file, void* memory, std::uint32_t slots, std::uint64_t slot_bytes)
      : file_(std::move(file)),
        memory_(static_cast<std::uint8_t*>(memory), {slots * slot_bytes}),
        slots_(slots),
        slot_bytes_(slot_bytes) {}
  [[nodiscard]] std::span<std::uint8_t> bytes_of(std::uint32_t slot) const;

  base::UniqueFd file_;
  std::unique_ptr<std::uint8_t, Unmap> memory_;
  std::uint32_t slots_;
  std::uint64_t slot_bytes_;
};

/// The time limit for a message to a client. A client reads immediately, so one that takes longer is stuck.
inline constexpr std::chrono::seconds kSendTime{5};

/// A view's shared memory, and its slots that wait for an image. May be used from any thread.
class ImageSlots {
 public:
  ImageSlots(SharedFrames frames, const CameraSettings& size)
      : frames_(std::move(frames)), size_(size), busy_(frames_.slots()) {}

  [[nodiscard]] std::uint32_t count() const { return frames_.slots(); }
  /// Returns false if the slot is in use.
  bool occupy(std::uint32_t slot);
  void release(std::uint32_t slot);
  [[nodiscard]] bool is_any_busy();
  /// Copies an image into a slot. Errors: kBadData: it is not of the view's size.
  Status write(std::uint32_t slot, const Image& image);

 private:
  SharedFrames frames_;
  const CameraSettings size_;
  std::mutex mutex_;
  std::vector<bool> busy_;
};

/// Waits for the images of one session, and notifies its client when each is ready, in any order.
class ImageSender {
 public:
  /// @param socket shut down if the client does not read
  explicit ImageSender(int socket);
  /// Abandons unfinished images.
  ~ImageSender();

  struct Order {
    std::uint64_t order = 0;
    std::shared_ptr<ImageSlots> slots;
    std::uint32_t slot = 0;  ///< occupied; released when the client is notified of its image
    std::shared_future<ImageResult> image;
  };
  void add(Order order);

 private:
  void work();
  [[nodiscard]] bool deliver(const Order& order) const;

  const int socket_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Order> added_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace twocone::sim_povray::server

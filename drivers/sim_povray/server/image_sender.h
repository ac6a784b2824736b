// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "drivers/sim_povray/server/shared_frames.h"
#include "hal/camera.h"
#include "hal/image.h"

namespace twocone::sim_povray::server {

/// A client reads immediately; one that has not read a message in this time is stuck.
inline constexpr std::chrono::seconds kSendTime{5};

/// A view's shared memory, and its slots that wait for an image. Any thread.
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
  /// Gives up unfinished images.
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

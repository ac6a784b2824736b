// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "drivers/sim_povray/link/shared_frames.h"
#include "hal/camera.h"
#include "hal/frame.h"

namespace twocone::sim_povray::link {

/// A view's shared memory, and which of its slots wait for a picture. Any thread.
class PictureSlots {
 public:
  PictureSlots(SharedFrames frames, const CameraSettings& size)
      : frames_(std::move(frames)), size_(size), busy_(frames_.slots()) {}

  [[nodiscard]] std::uint32_t count() const { return frames_.slots(); }
  /// False if it is in use.
  bool occupy(std::uint32_t slot);
  void release(std::uint32_t slot);
  [[nodiscard]] bool is_any_busy();
  /// Copies a picture in. Errors: kBadData: it is not of the view's size.
  Status write(std::uint32_t slot, const Image& picture);

 private:
  SharedFrames frames_;
  const CameraSettings size_;
  std::mutex mutex_;
  std::vector<bool> busy_;
};

/// Waits for the pictures of one seat and tells its client of each when it is there, in whatever order they come.
class PictureSender {
 public:
  /// @param socket shut down when the client does not listen
  explicit PictureSender(int socket);
  /// Gives up what is still on its way.
  ~PictureSender();

  struct Order {
    std::uint64_t order = 0;
    std::shared_ptr<PictureSlots> slots;
    std::uint32_t slot = 0;  ///< occupied; released when its picture is told of
    std::shared_future<ImageResult> picture;
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

}  // namespace twocone::sim_povray::link

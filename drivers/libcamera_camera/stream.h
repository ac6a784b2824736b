// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/libcamera_camera/device.h"
#include "drivers/libcamera_camera/memory.h"

namespace twocone::libcamera_camera {

/// An errno (positive) as an error of the camera.
Error device_error(const std::string& what, int code);

/// A request that came back, out of libcamera's hands until it is given back.
struct Newest {
  lc::Request* request = nullptr;
  const lc::FrameBuffer* buffer = nullptr;
  std::shared_ptr<const Memory> memory;
  std::uint64_t passed_over = 0;  ///< older ones that were given back for it
  bool was_starved = false;       ///< libcamera had none left to fill
};

/// A running stream: requests that go round between libcamera and the program. Frames that were lent keep it, and give
/// their requests back from any thread; after stop() they keep only the memory.
class Stream : public std::enable_shared_from_this<Stream> {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;

  /// Errors: kRefused, kUnavailable, kDisconnected.
  static Result<std::shared_ptr<Stream>> start(std::shared_ptr<Device> device, lc::Stream* stream,
                                               const lc::ControlList& controls);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// Waits until `deadline`; nothing: none came, or the camera is gone.
  std::optional<Newest> take_newest(SteadyTime deadline);
  void give_back(lc::Request* request);
  /// For the time that anybody keeps the result; then the request goes back.
  std::shared_ptr<const void> lend(const Newest& newest);
  /// How many libcamera has to fill.
  [[nodiscard]] std::size_t queued() const;
  /// Nothing came for so long.
  [[nodiscard]] bool is_silent(std::chrono::nanoseconds time) const;

  /// Not on a device that is gone: libcamera ends the program if requests do not come back.
  void stop();
  /// Instead of stop(): leaves it as it is, to the end of the program.
  static void abandon(const std::shared_ptr<Stream>& stream);

 private:
  explicit Stream(std::shared_ptr<Device> device) : device_(std::move(device)), told_(device_->told()) {}

  Status prepare(lc::Stream* stream);
  Status run(const lc::ControlList& controls);
  void queue(lc::Request* request);

  std::shared_ptr<Device> device_;  // until stop(): a frame that is kept does not keep the camera
  const std::shared_ptr<Told> told_;
  std::unique_ptr<lc::FrameBufferAllocator> allocator_;
  std::vector<std::unique_ptr<lc::Request>> requests_;
  std::map<const lc::FrameBuffer*, std::shared_ptr<const Memory>> memories_;
  bool running_ = false;  // under told_->mutex
};

}  // namespace twocone::libcamera_camera

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "drivers/memory/dice.h"
#include "hal/camera.h"

namespace twocone::memory {

/// What goes wrong with a camera on a bad cable. Chances are per grab, in [0, 1], and independent; 0 never, 1 always.
struct CameraFaults {
  double timeout_chance = 0;   ///< kTimeout at once (waiting would only slow tests down); no frame is lost by it
  double bad_data_chance = 0;  ///< kBadData; the frame is lost, which the next one tells in its lost_before
  double lost_chance = 0;      ///< a frame is lost, and the one after it handed out
  /// A frame comes `delay` after it could have, on the steady clock: a caller whose timeout is shorter gets kTimeout
  /// and, next time, a frame that is no longer the newest.
  double late_chance = 0;
  std::chrono::milliseconds delay{50};  ///< >= 0
  /// Up to a quarter of the rows, at least one, hold noise. Nothing tells: the bytes are as many as they should be.
  double garbled_chance = 0;
  double cut_chance = 0;  ///< bytes, at least one, are missing at the end, which to_rgb8() answers with kBadData
  /// So many grabs after start() the cable comes off: kDisconnected until the camera is stopped and started again.
  std::optional<std::uint64_t> disconnect_after;
};

/// @throws std::invalid_argument naming every field outside its domain
void check(const CameraFaults& faults);

/// Any camera, behind a bad cable. The same seed and calls give the same faults. A frame whose pixels are spoilt or
/// whose header tells of a loss is a copy: that grab waits for the pixels, within its timeout.
class FaultyCamera final : public Camera {
 public:
  /// @throws std::invalid_argument for a missing camera and as check() does
  FaultyCamera(std::unique_ptr<Camera> camera, const CameraFaults& faults, std::uint64_t seed);
  ~FaultyCamera() override;

 private:
  /// A frame on its way through the cable.
  struct InTransit {
    Frame frame;
    std::optional<std::chrono::steady_clock::time_point> arrives;  ///< if it is late
    bool garbled = false;
    bool cut = false;
  };

  Result<CameraSettings> do_configure(const CameraSettings& wanted) override;
  Status do_start() override;
  Result<Frame> do_grab(std::chrono::milliseconds timeout) override;
  void do_stop() noexcept override;

  Result<Frame> receive(std::chrono::steady_clock::time_point deadline);
  Image spoilt(Image image);

  std::unique_ptr<Camera> camera_;
  CameraFaults faults_;
  Dice dice_;   ///< which faults come
  Dice noise_;  ///< what a spoilt picture holds: apart, so that it does not shift the faults after it
  std::optional<InTransit> in_transit_;
  std::uint64_t lost_ = 0;  ///< by this cable since the frame handed out last
  std::uint64_t grabs_ = 0;
};

}  // namespace twocone::memory

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "hal/camera.h"
#include "tests/support/random_draws.h"

namespace twocone::testing_support {

/// Faults of a camera on a bad cable. Probabilities are per grab, in [0, 1], and independent; 0: never, 1: always.
struct CameraFaults {
  double timeout_chance = 0;   ///< kTimeout at once, because a wait would only slow tests down; no frame is lost
  double bad_data_chance = 0;  ///< kBadData; the frame is lost, and the next one counts it in its lost_before
  double lost_chance = 0;      ///< a frame is lost, and the one after it is returned
  /// A frame arrives `delay` late on the steady clock. A caller whose timeout is shorter gets kTimeout and, with the
  /// next call, a frame that is no longer the newest.
  double late_chance = 0;
  std::chrono::milliseconds delay{50};  ///< >= 0
  /// Up to a quarter of the rows, at least one, hold noise. It causes no error: the number of bytes is correct.
  double garbled_chance = 0;
  double cut_chance = 0;  ///< at least one byte is missing at the end, which to_rgb8() answers with kBadData
  /// The number of grabs after start() at which the cable comes off: kDisconnected until the camera is stopped and
  /// started again.
  std::optional<std::uint64_t> disconnect_after;
};

/// Checks the faults. @throws std::invalid_argument naming every field outside its domain
void check(const CameraFaults& faults);

/// Any camera behind an emulated bad cable. The same seed and calls give the same faults. A frame whose pixels are
/// damaged or whose header reports a loss is a copy: that grab waits for the pixels, within its timeout.
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
  RandomDraws random_;  ///< decides which faults occur
  RandomDraws noise_;   ///< fills damaged images; separate, because it must not shift the faults that follow
  std::optional<InTransit> in_transit_;
  std::uint64_t lost_ = 0;  ///< frames lost by this cable since the last frame that was returned
  std::uint64_t grabs_ = 0;
};

}  // namespace twocone::testing_support

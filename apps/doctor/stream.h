// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/doctor/surroundings.h"
#include "hal/camera.h"

namespace twocone::doctor {

/// Frames are judged after this time of the stream, in which a camera adjusts its exposure.
inline constexpr double kSettling_s = 0.5;
/// A rate that differs by at most this share is the requested one.
inline constexpr double kRateShare = 0.05;

/// Bounds the wait for frames, so that a broken camera cannot hold up the doctor: gives up after a few failures in a
/// row, and when frames come so slowly, or with such times, that it would take several times as long.
class FrameWait {
 public:
  /// @param seconds of frames that are wanted. @param least of patience for one frame
  FrameWait(double seconds, double rate_hz, std::chrono::milliseconds least, const Surroundings& surroundings);

  /// How long to wait for the next frame.
  [[nodiscard]] std::chrono::milliseconds patience() const { return patience_; }
  /// Returns whether to grab once more. @throws Interrupted
  [[nodiscard]] bool goes_on();
  /// Notes a frame.
  void came() { troubles_ = 0; }
  /// Notes a failure, and returns whether it may pass.
  [[nodiscard]] bool outlasts(const Error& error);

 private:
  const Surroundings& surroundings_;
  const std::chrono::milliseconds patience_;
  const double give_up_s_, most_grabs_;
  double grabs_ = 0;
  int troubles_ = 0;
};

/// Measurements of a streaming camera over some time.
struct Footage {
  /// Seconds of capture time from exposure to exposure; where frames were lost between them, their mean.
  std::vector<double> periods_s;
  /// The same, only for consecutive exposures.
  std::vector<double> neighbours_s;
  /// Age of frames when they were handed out; empty where their times come from another clock than the doctor's.
  std::vector<double> ages_s;
  std::uint64_t frames = 0;   ///< handed out
  std::uint64_t lost = 0;     ///< never received
  std::uint64_t skipped = 0;  ///< received, but skipped for a newer one
  std::uint64_t damaged = 0;  ///< reported as kBadData
  std::optional<Error> ended_by;
  std::optional<Result<Image>> image;  ///< the last one, kRgb8
};

/// Takes frames for `seconds` of their own time, after a short time in which the camera adjusts its exposure. Gives up
/// after a few consecutive time-outs, and when frames come so slowly, or with such times, that it would take several
/// times as long.
/// @param camera streaming. @param what for the progress. @throws Interrupted
Footage take_stream(Camera& camera, double seconds, const std::string& what, const Surroundings& surroundings);

}  // namespace twocone::doctor

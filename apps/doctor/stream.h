// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/doctor/surroundings.h"
#include "hal/camera.h"

namespace twocone::doctor {

/// What a streaming camera did for a while.
struct Footage {
  /// Seconds of capture time from exposure to exposure, where frames were lost between them their mean.
  std::vector<double> periods_s;
  /// The same, of exposures that came one after the other only.
  std::vector<double> neighbours_s;
  /// How old frames were when they were handed out; empty where their times are of another clock than the doctor's.
  std::vector<double> ages_s;
  std::uint64_t frames = 0;   ///< handed out
  std::uint64_t lost = 0;     ///< that never came
  std::uint64_t skipped = 0;  ///< that had come, and were passed over for a newer one
  std::uint64_t damaged = 0;  ///< answered by kBadData
  std::optional<Error> ended_by;
  std::optional<Result<Image>> picture;  ///< the last one, kRgb8
};

/// Takes frames for `seconds` of their own time, after a moment in which the camera finds its exposure; gives up after
/// a few time-outs in a row, and when frames come so slowly or with such times that it would take several times as
/// long.
/// @param camera streaming @param what for the progress @throws Interrupted
Footage take_stream(Camera& camera, double seconds, const std::string& what, const Surroundings& surroundings);

}  // namespace twocone::doctor

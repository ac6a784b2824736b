// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/doctor/surroundings.h"
#include "hal/camera.h"

namespace twocone::doctor {

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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "apps/doctor/report.h"
#include "apps/doctor/surroundings.h"
#include "hal/stereo_rig.h"

namespace twocone::doctor {

struct PairUnderTest {
  CameraSettings lower, upper;
  std::chrono::nanoseconds max_skew{0};
  std::chrono::nanoseconds command_timeout{0};
};

/// Opens both cameras again, with another limit of the skew.
using OpenPair = std::function<Result<StereoRig>(std::chrono::nanoseconds max_skew)>;

/// Measurements of a pair of cameras over some time.
struct Pairs {
  std::vector<double> skews_s{};      ///< from the lower camera's exposure to the upper one's
  std::vector<double> intervals_s{};  ///< from pair to pair
  std::uint64_t unpaired = 0;         ///< frames without a partner
  std::optional<Error> ended_by{};
};

/// Returns the rate of pairs, the frames without a partner and the longest wait, with the limit of the robot file.
std::vector<Row> judge_pairs(const Pairs& pairs, const PairUnderTest& test);
/// Returns the skew, and whether the limit suits these cameras. @param any their skews with a limit that pairs every
/// frame
Row judge_skew(const Pairs& any, const PairUnderTest& test);

/// Opens the pair, and again with a wide limit where that of the robot file leaves frames unpaired.
/// @throws Interrupted
void check_pair(const PairUnderTest& test, const OpenPair& open, double seconds, const Surroundings& surroundings,
                Report& report);

}  // namespace twocone::doctor

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "hal/result.h"

namespace twocone::runs {

/// Decides how long failing devices are asked again, and reports the begin and the end of each stretch of failures.
///
/// A stretch begins with the first failure and ends when everything answers again. A frame that only came damaged
/// (kBadData) does not last: its begin is reported, and it has no end.
class FaultPolicy {
 public:
  /// @param patience how long one stretch may last; 0: the first failure ends the run
  /// @param notify gets each sentence at once
  FaultPolicy(std::chrono::milliseconds patience, std::function<void(const std::string&)> notify);

  /// One more failure. An error is the reason to give up: `error` with the frame's number.
  Status failed(std::uint64_t frame, const Error& error);
  /// Everything answers.
  void over(std::uint64_t frame);

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  const std::chrono::milliseconds patience_;
  const std::function<void(const std::string&)> notify_;
  std::optional<SteadyTime> since_;
  bool has_end_ = false;
};

}  // namespace twocone::runs

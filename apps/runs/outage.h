// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "hal/result.h"

namespace twocone::runs {

/// Devices that fail on the way: what is told of it, and how long it is put up with.
///
/// A stretch of failures begins with the first and is over when everything answers again. Its begin and its end are
/// told in a sentence each; frames that only came damaged (kBadData) do not last, and have no end to tell.
class Outage {
 public:
  /// @param patience how long one stretch may last; 0: the first failure is the last
  /// @param tell gets each sentence at once
  Outage(std::chrono::milliseconds patience, std::function<void(const std::string&)> tell);

  /// One more failure. An error is the reason to give up: `error` with the frame's number.
  Status failed(std::uint64_t frame, const Error& error);
  /// Everything answers.
  void over(std::uint64_t frame);

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  const std::chrono::milliseconds patience_;
  const std::function<void(const std::string&)> tell_;
  std::optional<SteadyTime> since_;
  bool has_end_ = false;
};

}  // namespace twocone::runs

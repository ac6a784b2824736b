// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/outage.h"

#include <utility>

#include <fmt/format.h>

namespace twocone::runs {

Outage::Outage(std::chrono::milliseconds patience, std::function<void(const std::string&)> tell)
    : patience_(patience), tell_(std::move(tell)) {}

Status Outage::failed(std::uint64_t frame, const Error& error) {
  const SteadyTime now = std::chrono::steady_clock::now();
  const std::string what = fmt::format("frame {}: {}", frame, error.message);
  if (patience_.count() == 0) return Error{error.code, what};
  const bool begins = !since_;
  if (begins) since_ = now;
  if (now - *since_ >= patience_) {
    return Error{error.code,
                 fmt::format("{}, and so it stayed for {} s", what, std::chrono::duration<double>(patience_).count())};
  }
  const bool ends = error.code != ErrorCode::kBadData;
  if (ends && !has_end_) {
    tell_(fmt::format("{}: the wheels rest until it is well again", what));
  } else if (begins) {
    tell_(what);
  }
  has_end_ = has_end_ || ends;
  return {};
}

void Outage::over(std::uint64_t frame) {
  if (since_ && has_end_) {
    const std::chrono::duration<double> lasted = std::chrono::steady_clock::now() - *since_;
    tell_(fmt::format("frame {}: all is well again after {:.1f} s", frame, lasted.count()));
  }
  since_.reset();
  has_end_ = false;
}

}  // namespace twocone::runs

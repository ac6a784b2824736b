// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/fault_policy.h"

#include <utility>

#include <fmt/format.h>

#include "base/log.h"

namespace twocone::runs {

FaultPolicy::FaultPolicy(std::chrono::milliseconds patience, std::function<void(const std::string&)> notify)
    : patience_(patience), notify_(std::move(notify)) {}

Status FaultPolicy::failed(std::uint64_t frame, const Error& error) {
  const SteadyTime now = std::chrono::steady_clock::now();
  const std::string what = fmt::format("frame {}: {}", frame, error.message);
  if (patience_.count() == 0) return Error{error.code, what};
  const bool begins = !since_;
  if (begins) since_ = now;
  if (now - *since_ >= patience_) {
    return Error{error.code,
                 fmt::format("{}, and so it stayed for {} s", what, std::chrono::duration<double>(patience_).count())};
  }
  base::Logger("run").warning(what + "; tried again");
  const bool ends = error.code != ErrorCode::kBadData;
  if (ends && !has_end_) {
    notify_(fmt::format("{}: the wheels are stopped until it answers again", what));
  } else if (begins) {
    notify_(what);
  }
  has_end_ = has_end_ || ends;
  return {};
}

void FaultPolicy::over(std::uint64_t frame) {
  if (since_ && has_end_) {
    const std::chrono::duration<double> lasted = std::chrono::steady_clock::now() - *since_;
    notify_(fmt::format("frame {}: all is well again after {:.1f} s", frame, lasted.count()));
  }
  since_.reset();
  has_end_ = false;
}

}  // namespace twocone::runs

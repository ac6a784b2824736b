// SPDX-License-Identifier: Apache-2.0
#include "hal/stereo_rig.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/log.h"

namespace twocone {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kBetweenTries{250};

milliseconds until(std::chrono::steady_clock::time_point deadline) {
  const auto left = std::chrono::duration_cast<milliseconds>(deadline - std::chrono::steady_clock::now());
  return std::max(left, milliseconds(0));
}

nanoseconds times(double factor, nanoseconds period) {
  return nanoseconds(std::llround(factor * double(period.count())));
}

}  // namespace

StereoRig::StereoRig(std::unique_ptr<Camera> lower, std::unique_ptr<Camera> upper, std::chrono::nanoseconds max_skew)
    : lower_{"lower", std::move(lower)}, upper_{"upper", std::move(upper)}, max_skew_(max_skew) {
  if (!lower_.camera || !upper_.camera) throw std::invalid_argument("StereoRig: needs a lower and an upper camera");
  if (max_skew.count() < 0) {
    throw base::InvalidArgument("StereoRig: max_skew is {} ns, must be >= 0", max_skew.count());
  }
}

Status StereoRig::start(Eye& eye) {
  eye.waiting.reset();
  eye.next.reset();
  auto started = start_camera(eye.view, *eye.camera, eye.settings);
  if (!started) return started;
  eye.is_lost = false;
  eye.period = nanoseconds(std::llround(1e9 / eye.camera->facts().settings.rate_hz));
  return started;
}

Status StereoRig::start(const CameraSettings& lower, const CameraSettings& upper) {
  lower_.settings = lower;
  upper_.settings = upper;
  lower_.is_lost = upper_.is_lost = false;
  if (auto started = start(lower_); !started) return started;
  auto started = start(upper_);
  if (!started) lower_.camera->stop();
  return started;
}

void StereoRig::lose(Eye& eye) {
  base::Logger("cameras").warning(fmt::format("{}: disconnected; it will be started again", eye.view));
  eye.camera->stop();
  eye.is_lost = true;
  eye.next_try = std::chrono::steady_clock::now();
}

void StereoRig::drop(std::unique_ptr<Frame>& frame) {
  if (frame) ++unpaired_;
  if (frame) base::Logger("cameras").debug("a frame without a partner is dropped");
  frame.reset();
}

/// Replaces the waiting frame by the camera's next one. If there is none, waits until `end`.
void StereoRig::let_pass(Eye& eye, SteadyTime end) {
  if (!eye.is_lost) {
    auto frame = eye.camera->grab(until(end));
    if (frame) {
      drop(eye.waiting);
      drop(eye.next);
      eye.waiting = std::make_unique<Frame>(std::move(*frame));
      return;
    }
    if (frame.error().code == ErrorCode::kDisconnected) lose(eye);
  }
  std::this_thread::sleep_until(end);
}

Status StereoRig::look_for(Eye& eye, Eye& other, SteadyTime deadline) {
  const SteadyTime end = std::min(eye.next_try, deadline);
  if (std::chrono::steady_clock::now() < eye.next_try) let_pass(other, end);
  const SteadyTime now = std::chrono::steady_clock::now();
  if (now < eye.next_try) {
    return Error(ErrorCode::kDisconnected, "{}: the camera is disconnected; waiting for it", eye.view);
  }
  eye.next_try = now + kBetweenTries;
  if (auto started = start(eye); !started) return started;
  ++recoveries_;
  base::Logger("cameras").info(fmt::format("{}: started again", eye.view));
  return {};
}

Status StereoRig::fill(Eye& eye, Eye& other, SteadyTime deadline) {
  if (eye.is_lost) {
    if (auto found = look_for(eye, other, deadline); !found) return found;
  }
  auto frame = eye.camera->grab(until(deadline));
  if (frame) {
    eye.waiting = std::make_unique<Frame>(std::move(*frame));
    return {};
  }
  if (frame.error().code == ErrorCode::kDisconnected) lose(eye);
  return with_name(eye.view, frame.error());
}

nanoseconds StereoRig::waiting_skew() const {
  return upper_.waiting->header().captured - lower_.waiting->header().captured;
}

/// Replaces the older frame by the next one of the same camera if that is nearer in time to the newer frame. It waits
/// at most one period, within which the next frame is due, even if a camera is slower than the rate it reports.
Status StereoRig::find_nearer(SteadyTime deadline) {
  const nanoseconds skew = waiting_skew();
  Eye& older = skew.count() > 0 ? lower_ : upper_;
  if (older.is_lost || std::chrono::abs(skew) <= times(kFreeSkew, older.period)) return {};
  const SteadyTime end = std::min(deadline, std::chrono::steady_clock::now() + older.period);
  auto next = older.camera->grab(until(end));
  if (!next) {
    if (next.error().code == ErrorCode::kTimeout) return {};
    if (next.error().code == ErrorCode::kDisconnected) lose(older);
    return with_name(older.view, next.error());
  }
  auto came = std::make_unique<Frame>(std::move(*next));
  const nanoseconds with_it =
      came->header().captured - (&older == &lower_ ? upper_ : lower_).waiting->header().captured;
  if (std::chrono::abs(with_it) < std::chrono::abs(skew)) {
    drop(older.waiting);
    older.waiting = std::move(came);
  } else {
    older.next = std::move(came);
  }
  return {};
}

Result<StereoFrame> StereoRig::grab(milliseconds timeout) {
  if (timeout.count() < 0) {
    throw base::InvalidArgument("StereoRig::grab: timeout is {} ms, must be >= 0", timeout.count());
  }
  const auto deadline = std::chrono::steady_clock::now() + std::min(timeout, kLongestWait);
  while (true) {
    for (Eye* eye : {&lower_, &upper_}) {
      if (!eye->waiting) eye->waiting = std::move(eye->next);
      if (eye->waiting) continue;
      if (auto filled = fill(*eye, eye == &lower_ ? upper_ : lower_, deadline); !filled) return filled.error();
    }
    const nanoseconds skew = waiting_skew();
    if (std::chrono::abs(skew) <= max_skew_) {
      if (auto looked = find_nearer(deadline); !looked) return looked.error();
      StereoFrame pair{std::move(*lower_.waiting), std::move(*upper_.waiting)};
      lower_.waiting.reset();
      upper_.waiting.reset();
      return pair;
    }
    drop(skew.count() > 0 ? lower_.waiting : upper_.waiting);
    if (std::chrono::steady_clock::now() >= deadline) {
      return Error(ErrorCode::kTimeout,
                   "no two frames within {} ms of each other came within {} ms; the last two were {} ms apart",
                   std::chrono::duration<double, std::milli>(max_skew_).count(), timeout.count(),
                   std::chrono::duration<double, std::milli>(std::chrono::abs(skew)).count());
    }
  }
}

void StereoRig::stop() noexcept {
  for (Eye* eye : {&lower_, &upper_}) {
    if (eye->camera) eye->camera->stop();
    eye->waiting.reset();
    eye->next.reset();
    eye->is_lost = false;
  }
}

}  // namespace twocone

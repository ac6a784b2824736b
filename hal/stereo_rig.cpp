// SPDX-License-Identifier: Apache-2.0
#include "hal/stereo_rig.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "hal/named_camera.h"

namespace twocone {

StereoRig::StereoRig(std::unique_ptr<Camera> lower, std::unique_ptr<Camera> upper, std::chrono::nanoseconds max_skew)
    : lower_(std::move(lower)), upper_(std::move(upper)), max_skew_(max_skew) {
  if (!lower_ || !upper_) throw std::invalid_argument("StereoRig: needs a lower and an upper camera");
  if (max_skew.count() < 0) {
    throw std::invalid_argument(fmt::format("StereoRig: max_skew is {} ns, must be >= 0", max_skew.count()));
  }
}

Status StereoRig::start(const CameraSettings& lower, const CameraSettings& upper) {
  if (auto started = start_camera("lower", *lower_, lower); !started) return started;
  auto started = start_camera("upper", *upper_, upper);
  if (!started) lower_->stop();
  return started;
}

Status StereoRig::grab_into(const char* view, Camera& camera, std::unique_ptr<Frame>& slot,
                            std::chrono::steady_clock::time_point deadline) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  auto frame = camera.grab(std::max(left, std::chrono::milliseconds(0)));
  if (!frame) return with_name(view, frame.error());
  slot = std::make_unique<Frame>(std::move(*frame));
  return {};
}

Result<StereoFrame> StereoRig::grab(std::chrono::milliseconds timeout) {
  if (timeout.count() < 0) {
    throw std::invalid_argument(fmt::format("StereoRig::grab: timeout is {} ms, must be >= 0", timeout.count()));
  }
  const auto deadline = std::chrono::steady_clock::now() + std::min(timeout, kLongestWait);
  while (true) {
    if (!waiting_lower_) {
      if (auto got = grab_into("lower", *lower_, waiting_lower_, deadline); !got) return got.error();
    }
    if (!waiting_upper_) {
      if (auto got = grab_into("upper", *upper_, waiting_upper_, deadline); !got) return got.error();
    }
    const auto skew = waiting_upper_->header().captured - waiting_lower_->header().captured;
    if (std::chrono::abs(skew) <= max_skew_) {
      StereoFrame pair{std::move(*waiting_lower_), std::move(*waiting_upper_)};
      waiting_lower_.reset();
      waiting_upper_.reset();
      return pair;
    }
    ++unpaired_;
    (skew.count() > 0 ? waiting_lower_ : waiting_upper_).reset();
    if (std::chrono::steady_clock::now() >= deadline) {
      return Error{
          ErrorCode::kTimeout,
          fmt::format("no two frames within {} ms of each other came within {} ms; the last two were {} ms apart",
                      std::chrono::duration<double, std::milli>(max_skew_).count(), timeout.count(),
                      std::chrono::duration<double, std::milli>(std::chrono::abs(skew)).count())};
    }
  }
}

void StereoRig::stop() noexcept {
  if (lower_) lower_->stop();
  if (upper_) upper_->stop();
  waiting_lower_.reset();
  waiting_upper_.reset();
}

}  // namespace twocone

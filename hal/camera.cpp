// SPDX-License-Identifier: Apache-2.0
#include "hal/camera.h"

#include <algorithm>
#include <cmath>

#include <fmt/ranges.h>

#include "base/errors.h"

namespace twocone {

void check(const CameraSettings& settings) {
  base::Complaints bad;
  if (settings.width_px <= 0) bad.add("width_px is {}, must be > 0", settings.width_px);
  if (settings.height_px <= 0) bad.add("height_px is {}, must be > 0", settings.height_px);
  bad.positive("rate_hz", settings.rate_hz, "Hz");
  bad.raise("CameraSettings");
}

Result<CameraSettings> Camera::configure(const CameraSettings& settings) {
  check(settings);
  if (state_ == State::kStreaming) {
    return Error{ErrorCode::kInvalidState, "configure: the camera is streaming; stop it first"};
  }
  auto applied = do_configure(settings);
  if (applied) {
    applied_ = *applied;
    state_ = State::kConfigured;
  }
  return applied;
}

CameraFacts Camera::facts() const {
  CameraFacts facts;
  facts.settings = applied_;
  do_facts(facts);
  return facts;
}

Status Camera::start() {
  if (state_ == State::kClosed) return Error{ErrorCode::kInvalidState, "start: configure the camera first"};
  if (state_ == State::kStreaming) return Error{ErrorCode::kInvalidState, "start: the camera is streaming already"};
  auto started = do_start();
  if (started) state_ = State::kStreaming;
  return started;
}

Result<Frame> Camera::grab(std::chrono::milliseconds timeout) {
  if (timeout.count() < 0) {
    throw base::InvalidArgument("Camera::grab: timeout is {} ms, must be >= 0", timeout.count());
  }
  if (state_ != State::kStreaming) return Error{ErrorCode::kInvalidState, "grab: start the camera first"};
  return do_grab(std::min(timeout, kLongestWait));
}

void Camera::stop() noexcept {
  if (state_ != State::kStreaming) return;
  do_stop();
  state_ = State::kConfigured;
}

Status start_camera(const std::string& name, Camera& camera, const CameraSettings& wanted) {
  const auto applied = camera.configure(wanted);
  if (!applied) return with_name(name, applied.error());
  if (applied->width_px != wanted.width_px || applied->height_px != wanted.height_px) {
    return Error(ErrorCode::kRefused,
                 "{}: the camera gives {} x {} pixels instead of {} x {}; ask for a size that it has", name,
                 applied->width_px, applied->height_px, wanted.width_px, wanted.height_px);
  }
  if (const auto started = camera.start(); !started) return with_name(name, started.error());
  return {};
}

void check(const CameraDevice& device, std::string_view settings) {
  base::Complaints bad;
  if (device.name.empty()) bad.add("device is missing");
  if (!device.format.empty() && std::ranges::find(kCameraFormats, device.format) == kCameraFormats.end()) {
    bad.add("format is '{}', must be one of {}", device.format, fmt::join(kCameraFormats, ", "));
  }
  for (const auto& [name, value] : device.controls) {
    if (name.empty()) bad.add("a control has no name");
    if (!std::isfinite(value)) bad.add("control {} is {}", name, value);
  }
  bad.raise(settings);
}

}  // namespace twocone

// SPDX-License-Identifier: Apache-2.0
#include "tests/support/faulty_camera.h"

#include <algorithm>
#include <stdexcept>
#include <thread>

namespace twocone::testing_support {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

steady_clock::time_point deadline_after(milliseconds timeout) {
  // The largest timeouts do not fit into the clock's type; a day is long enough here.
  return steady_clock::now() + std::min<milliseconds>(timeout, std::chrono::hours(24));
}

milliseconds left_until(steady_clock::time_point deadline) {
  const auto left = std::chrono::duration_cast<milliseconds>(deadline - steady_clock::now());
  return std::max(left, milliseconds(0));
}

Frame failed(const Frame::Header& header, const Error& error) { return {header, ready_image(error)}; }

}  // namespace

void check(const CameraFaults& faults) {
  std::string bad = complaint("timeout_chance", faults.timeout_chance) +
                    complaint("bad_data_chance", faults.bad_data_chance) +
                    complaint("lost_chance", faults.lost_chance) + complaint("late_chance", faults.late_chance) +
                    complaint("garbled_chance", faults.garbled_chance) + complaint("cut_chance", faults.cut_chance);
  if (faults.delay.count() < 0) bad += fmt::format(" delay is {} ms, must be >= 0;", faults.delay.count());
  if (!bad.empty()) throw std::invalid_argument("CameraFaults:" + bad);
}

FaultyCamera::FaultyCamera(std::unique_ptr<Camera> camera, const CameraFaults& faults, std::uint64_t seed)
    : camera_(std::move(camera)), faults_(faults), random_(seed), noise_(~seed) {
  if (!camera_) throw std::invalid_argument("FaultyCamera: needs a camera");
  check(faults);
}

FaultyCamera::~FaultyCamera() { stop(); }

Result<CameraSettings> FaultyCamera::do_configure(const CameraSettings& wanted) { return camera_->configure(wanted); }

Status FaultyCamera::do_start() {
  grabs_ = 0;
  lost_ = 0;
  in_transit_.reset();
  return camera_->start();
}

void FaultyCamera::do_stop() noexcept {
  in_transit_.reset();
  camera_->stop();
}

Result<Frame> FaultyCamera::do_grab(milliseconds timeout) {
  if (faults_.disconnect_after && grabs_ >= *faults_.disconnect_after) {
    in_transit_.reset();
    return Error(ErrorCode::kDisconnected, "the cable came off after {} grabs", *faults_.disconnect_after);
  }
  ++grabs_;
  // Every grab draws all of them: see RandomDraws::happens.
  const bool times_out = random_.happens(faults_.timeout_chance);
  const bool bad_data = random_.happens(faults_.bad_data_chance);
  const bool loses = random_.happens(faults_.lost_chance);
  const bool late = random_.happens(faults_.late_chance);
  const bool garbled = random_.happens(faults_.garbled_chance);
  const bool cut = random_.happens(faults_.cut_chance);

  if (times_out) return Error{ErrorCode::kTimeout, "the bad cable let nothing through"};
  const auto deadline = deadline_after(timeout);
  if (!in_transit_) {
    if (bad_data || loses) {
      const auto frame = camera_->grab(left_until(deadline));
      if (!frame) return frame.error();
      lost_ += 1 + frame->header().lost_before;
      if (bad_data) return Error{ErrorCode::kBadData, "the bytes that came over the bad cable are not a frame"};
    }
    auto frame = camera_->grab(left_until(deadline));
    if (!frame) return frame.error();
    in_transit_ = InTransit{std::move(*frame), {}, garbled, cut};
    if (late) in_transit_->arrives = steady_clock::now() + faults_.delay;
  }
  return receive(deadline);
}

Result<Frame> FaultyCamera::receive(steady_clock::time_point deadline) {
  if (const auto arrives = in_transit_->arrives) {
    std::this_thread::sleep_until(std::min(*arrives, deadline));
    if (*arrives > deadline) return Error{ErrorCode::kTimeout, "the frame is late on the bad cable"};
  }

  if (lost_ > 0 || in_transit_->garbled || in_transit_->cut) {
    // A frame is immutable, so its pixels must have arrived and are copied before they are changed.
    const auto pixels = in_transit_->frame.image(left_until(deadline));
    if (!pixels && pixels.error().code == ErrorCode::kTimeout) return pixels.error();
    Frame::Header header = in_transit_->frame.header();
    header.lost_before += lost_;
    in_transit_->frame = pixels ? Frame(header, spoilt(**pixels)) : failed(header, pixels.error());
  }
  Frame frame = std::move(in_transit_->frame);
  in_transit_.reset();
  lost_ = 0;
  return frame;
}

Image FaultyCamera::spoilt(Image image) {
  const auto rows = static_cast<std::uint64_t>(image.height_px);
  if (in_transit_->garbled && rows > 0 && !image.bytes.empty()) {
    const std::size_t row_bytes = image.bytes.size() / rows;
    const std::uint64_t count = 1 + noise_.below(std::max<std::uint64_t>(rows / 4, 1));
    const std::uint64_t first = noise_.below(rows - count + 1);
    const auto from = image.bytes.begin() + static_cast<std::ptrdiff_t>(first * row_bytes);
    std::generate_n(from, count * row_bytes, [this] { return noise_.byte(); });
  }
  if (in_transit_->cut && !image.bytes.empty()) image.bytes.resize(noise_.below(image.bytes.size()));
  return image;
}

}  // namespace twocone::testing_support

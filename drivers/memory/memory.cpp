// SPDX-License-Identifier: Apache-2.0
#include "drivers/memory/memory.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace twocone::memory {
namespace {

using std::numbers::pi;

/// Returns the azimuth of a pixel about the image's centre, in radians; 0 at the centre itself.
double azimuth_rad(const Image& image, int row, int column) {
  return std::atan2(row - 0.5 * (image.height_px - 1), column - 0.5 * (image.width_px - 1));
}

int nearest_place(double angle_rad) {
  const auto place = static_cast<int>(std::lround(angle_rad * kMarkPlaces / (2 * pi)));
  return (place % kMarkPlaces + kMarkPlaces) % kMarkPlaces;
}

std::uint8_t* pixel(Image& image, int row, int column) {
  return image.bytes.data() + 3 * (std::size_t(row) * std::size_t(image.width_px) + std::size_t(column));
}

/// Returns the red, green or blue of a saturated hue: a trapezium over the hues, 0 opposite the channel's own hue.
std::uint8_t channel_of_hue(double hue_rad, double channel_hue_rad) {
  const double apart = std::abs(std::remainder(hue_rad - channel_hue_rad, 2 * pi));
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(2 - apart * 3 / pi, 0.0, 1.0)));
}

}  // namespace

Image test_pattern(std::uint64_t sequence, const CameraSettings& settings) {
  Image image{settings.width_px, settings.height_px, PixelFormat::kRgb8, {}};
  image.bytes.resize(std::size_t(settings.width_px) * std::size_t(settings.height_px) * 3);
  const auto marked = static_cast<int>(sequence % kMarkPlaces);
  for (int row = 0; row < image.height_px; ++row) {
    for (int column = 0; column < image.width_px; ++column) {
      const double azimuth = azimuth_rad(image, row, column);
      const bool white = nearest_place(azimuth) == marked;
      for (int channel = 0; channel < 3; ++channel) {
        pixel(image, row, column)[channel] = white ? 255 : channel_of_hue(azimuth, channel * 2 * pi / 3);
      }
    }
  }
  return image;
}

MemoryCamera::MemoryCamera(std::shared_ptr<ManualClock> clock) : clock_(std::move(clock)) {
  if (!clock_) throw std::invalid_argument("MemoryCamera: needs a clock");
}

Result<CameraSettings> MemoryCamera::do_configure(const CameraSettings& wanted) {
  return settings_ = {std::min(wanted.width_px, kLargestSide_px), std::min(wanted.height_px, kLargestSide_px),
                      std::clamp(wanted.rate_hz, kSlowest_hz, kFastest_hz)};
}

Status MemoryCamera::do_start() {
  started_ = clock_->now();
  next_ = 0;
  return {};
}

std::chrono::nanoseconds MemoryCamera::since_start(std::uint64_t sequence) const {
  // The time is computed from the count, not from the previous exposure: a sum of rounded periods would drift.
  return std::chrono::nanoseconds(std::llround(static_cast<double>(sequence) * 1e9 / settings_.rate_hz));
}

std::uint64_t MemoryCamera::exposed() const {
  const auto running = clock_->now() - started_;
  auto count = static_cast<std::uint64_t>(std::chrono::duration<double>(running).count() * settings_.rate_hz);
  // The product may be off by a rounding error in either direction. The correction makes it agree with since_start().
  while (since_start(count) <= running) ++count;
  while (count > 0 && since_start(count - 1) > running) --count;
  return count;
}

Result<Frame> MemoryCamera::do_grab(std::chrono::milliseconds /*timeout*/) {
  const auto wait = since_start(next_) - (clock_->now() - started_);
  if (wait.count() > 0) clock_->advance(wait);
  const std::uint64_t newest = exposed() - 1;
  const Frame::Header header{newest, {started_.clock, started_.since_zero + since_start(newest)}, newest - next_};
  next_ = newest + 1;
  return Frame(header, test_pattern(newest, settings_));
}

Wheels::Wheels(std::shared_ptr<const Clock> clock, std::chrono::nanoseconds command_timeout)
    : clock_(std::move(clock)), command_timeout_(command_timeout) {
  if (!clock_) throw std::invalid_argument("Wheels: needs a clock");
}

void Wheels::command(const WheelSpeeds& speeds) {
  at_last_command_ = angles();
  commands_.push_back({at_last_command_.time, speeds});
}

WheelSpeeds Wheels::speeds() const {
  if (commands_.empty() || clock_->now() - commands_.back().time >= command_timeout_) return {};
  return commands_.back().speeds;
}

WheelAngles Wheels::angles() const {
  WheelAngles angles = at_last_command_;
  angles.time = clock_->now();
  if (commands_.empty()) return angles;
  const Command& last = commands_.back();
  const std::chrono::duration<double> turning = std::min(angles.time - last.time, command_timeout_);
  angles.left_rad += last.speeds.left_radps * turning.count();
  angles.right_rad += last.speeds.right_radps * turning.count();
  return angles;
}

}  // namespace twocone::memory

// SPDX-License-Identifier: Apache-2.0
#include "bench/growth/seen.h"

#include <cassert>
#include <mutex>
#include <stdexcept>

#include "bench/growth/growth.h"

namespace twocone::bench {
namespace {

constexpr auto kLong = std::chrono::minutes(5);

}  // namespace

Seen seen_at(const sim_povray::Venue& venue, sim_povray::SeatSettings seat, const files::Robot& robot,
             const Pose2& pose) {
  std::mutex mutex;
  double ms = 0;
  seat.body.begin = pose;
  seat.rendered = [&](const sim_povray::RenderedPicture& picture) {
    const std::lock_guard lock(mutex);
    ms += 1e-6 * double(picture.cpu.count());
  };
  const auto simulation = value(venue.enter(seat));
  const auto cameras = start_pair(*simulation, {robot.lower.width_px, robot.lower.height_px, robot.lower.rate_hz},
                                  robot.lower.antialias);
  std::vector<Frame> frames;
  frames.reserve(cameras.size());
  for (const auto& camera : cameras) frames.push_back(value(camera->grab(kLong)));
  Seen seen;
  seen.pictures.reserve(frames.size());
  for (const Frame& frame : frames) {
    const auto image = value(frame.image(kLong));
    assert(image->format == PixelFormat::kRgb8);
    seen.pictures.push_back(
        cv::Mat(image->height_px, image->width_px, CV_8UC3, const_cast<std::uint8_t*>(image->bytes.data())).clone());
  }
  const std::lock_guard lock(mutex);
  seen.render_ms = ms;
  return seen;
}

}  // namespace twocone::bench

// SPDX-License-Identifier: Apache-2.0
#include "bench/growth/seen.h"

#include <cassert>
#include <mutex>
#include <stdexcept>

#include "bench/growth/growth.h"
#include "drivers/sim_povray/simulation.h"

namespace twocone::bench {
namespace {

constexpr auto kLong = std::chrono::minutes(5);

}  // namespace

Seen seen_at(sim_povray::SimulationHost& host, sim_povray::SessionSettings session, const config::Robot& robot,
             const Pose2& pose) {
  std::mutex mutex;
  double ms = 0;
  session.body.begin = pose;
  session.rendered = [&](const sim_povray::RenderedImage& image) {
    const std::lock_guard lock(mutex);
    ms += 1e-6 * double(image.cpu.count());
  };
  if (const auto empty = host.reset(); !empty) throw std::runtime_error(empty.error().message);
  const auto simulation = value(sim_povray::Simulation::join(host, session));
  const auto cameras = start_pair(*simulation, robot.lower.settings, robot.lower.antialias);
  std::vector<Frame> frames;
  frames.reserve(cameras.size());
  for (const auto& camera : cameras) frames.push_back(value(camera->grab(kLong)));
  Seen seen;
  seen.images.reserve(frames.size());
  for (const Frame& frame : frames) {
    const auto image = value(frame.image(kLong));
    assert(image->format == PixelFormat::kRgb8);
    seen.images.push_back(
        cv::Mat(image->height_px, image->width_px, CV_8UC3, const_cast<std::uint8_t*>(image->bytes.data())).clone());
  }
  const std::lock_guard lock(mutex);
  seen.render_ms = ms;
  return seen;
}

}  // namespace twocone::bench

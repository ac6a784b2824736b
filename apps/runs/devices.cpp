// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/devices.h"

#include <utility>

#include <fmt/format.h>

namespace twocone::runs {

std::string describe(const std::string& view, const CameraFacts& facts) {
  if (facts.device.empty()) return {};
  const CameraSettings& applied = facts.settings;
  std::string text = fmt::format("{}: {}, {} {} x {} at {:.4g} Hz{}", view, facts.device, facts.format,
                                 applied.width_px, applied.height_px, applied.rate_hz,
                                 facts.rate_told ? "" : " (as asked for: the camera does not tell)");
  for (const auto& [name, value] : facts.controls) text += fmt::format(", {} {}", name, value);
  return text;
}

std::string describe(const DriveFacts& facts) {
  if (facts.device.empty()) return {};
  std::string text =
      fmt::format("drive: {}, {}, {} counts a turn", facts.device, facts.controller, facts.counts_per_turn);
  text += facts.own_timeout ? fmt::format(", its own time-out {} ms", facts.own_timeout->count())
                            : ", no time-out of its own";
  return text + (facts.has_watchdog ? ", guarded" : ", no watchdog");
}

Status decode(Frame& frame) {
  const auto image = frame.image(std::chrono::milliseconds(0));
  if (!image) return image.error();
  auto rgb = to_rgb8(**image);
  if (!rgb) return rgb.error();
  // What the camera sends as rgb8 already comes back as it is: a copy, so that the buffer is the device's again.
  if (rgb->bytes.is_lent()) rgb->bytes = Bytes((*image)->bytes.begin(), (*image)->bytes.end());
  frame = Frame(frame.header(), std::move(*rgb));
  return {};
}

Status decode(StereoFrame& frame) {
  if (auto decoded = decode(frame.lower); !decoded) return with_name("lower", decoded.error());
  if (auto decoded = decode(frame.upper); !decoded) return with_name("upper", decoded.error());
  return {};
}

}  // namespace twocone::runs

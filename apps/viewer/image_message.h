// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "apps/web/server.h"
#include "hal/image.h"

namespace twocone::viewer {

/// Returns an object as a line of the stream.
inline std::string text_of(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// Returns an image as a message of the stream (docs/telemetry.md), or nothing if it cannot be compressed.
/// @param number,view as they stand in the message
inline std::optional<web::Message> image_message(std::uint64_t number, int view, const Image& image) {
  constexpr int kQuality = 80;
  constexpr char kJpeg = 0;
  const Result<Image> jpeg = image.format == PixelFormat::kMjpeg ? image : to_mjpeg(image, kQuality);
  if (!jpeg) return std::nullopt;
  std::string bytes;
  for (unsigned shift = 0; shift < 64; shift += 8) bytes += char(number >> shift & 0xFFU);
  bytes += char(view);
  bytes += kJpeg;
  bytes.append(jpeg->bytes.begin(), jpeg->bytes.end());
  return web::Message{std::move(bytes), true};
}

}  // namespace twocone::viewer

// SPDX-License-Identifier: Apache-2.0
#include "apps/viewer/serving.h"

#include <utility>

#include <nlohmann/json.hpp>

#include "apps/web/document.h"

namespace twocone::viewer {

Result<std::string> serve(std::string_view page, std::string_view title, std::string_view plain_text,
                          const PageAddress& at, web::Site& site, std::unique_ptr<web::Server>& server,
                          web::ProgramStream programs) {
  auto opened = web::Server::open({.address = at.address,
                                   .port = at.port,
                                   .page = web::document({{"page", page}}, title, plain_text),
                                   .programs = std::move(programs),
                                   .timeouts = {}},
                                  site);
  if (!opened) return opened.error();
  server = *std::move(opened);
  return server->address();
}

std::string text_of(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::optional<std::string> jpeg_of(const Image& image) {
  constexpr int kQuality = 80;
  const Result<Image> jpeg = image.format == PixelFormat::kMjpeg ? image : to_mjpeg(image, kQuality);
  if (!jpeg) return std::nullopt;
  return std::string(jpeg->bytes.begin(), jpeg->bytes.end());
}

std::optional<web::Message> image_message(std::uint64_t number, int view, const Image& image) {
  constexpr char kJpeg = 0;
  const std::optional<std::string> jpeg = jpeg_of(image);
  if (!jpeg) return std::nullopt;
  std::string bytes;
  for (unsigned shift = 0; shift < 64; shift += 8) bytes += char(number >> shift & 0xFFU);
  bytes += char(view);
  bytes += kJpeg;
  return web::Message{bytes + *jpeg, true};
}

}  // namespace twocone::viewer

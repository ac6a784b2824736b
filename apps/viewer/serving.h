// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "apps/web/server.h"
#include "hal/image.h"
#include "hal/result.h"

/// What all served pages share.
namespace twocone::viewer {

/// Where to serve a page.
struct PageAddress {
  std::string address = "127.0.0.1";
  std::uint16_t port = 0;  ///< 0: any that is free
};

/// Begins to serve a page of the viewer, and returns its address with its token. Errors: those of web::Server::open
/// @param page,title,plain_text as for web::document
/// @param server receives the server, which uses `site`
Result<std::string> serve(std::string_view page, std::string_view title, std::string_view plain_text,
                          const PageAddress& at, web::Site& site, std::unique_ptr<web::Server>& server,
                          web::ProgramStream programs = {});

/// Returns an object as a line of the stream.
std::string text_of(const nlohmann::ordered_json& json);

/// Returns the JPEG file of an image, as all streams send it, or nothing if it cannot be compressed.
std::optional<std::string> jpeg_of(const Image& image);

/// Returns an image as a message of the stream (docs/telemetry.md), or nothing if it cannot be compressed.
/// @param number,view as they stand in the message
std::optional<web::Message> image_message(std::uint64_t number, int view, const Image& image);

}  // namespace twocone::viewer

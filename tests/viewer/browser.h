// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/web/client.h"

namespace twocone::viewer {

/// A browser that has opened the stream of a page.
class Browser {
 public:
  explicit Browser(const std::string& address) : address_(web::parse_served(address)), client_(address_) {
    client_.send(web::request(address_, "/stream?token=" + address_.token, web::upgrade_headers()));
    is_open_ = client_.reply().value_or(web::Reply{}).status == 101;
  }

  [[nodiscard]] bool is_open() const { return is_open_; }
  void send(const nlohmann::json& request) { client_.send(web::browser_text(request.dump())); }
  void send_text(std::string_view text) { client_.send(web::browser_text(text)); }
  /// Breaks the connection, as a killed browser does.
  void kill() { client_.reset(); }

  /// Returns the next message of a type. Those before it are dropped; images are counted.
  std::optional<nlohmann::json> next(const std::string& type) {
    while (const auto frame = client_.frame()) {
      if (frame->opcode == web::kBinary) last_image_ = frame->payload;
      if (frame->opcode != web::kText) continue;
      nlohmann::json json = nlohmann::json::parse(frame->payload, nullptr, false);
      if (json.is_object() && json["type"] == type) return json;
    }
    return std::nullopt;
  }
  /// Returns the last image that came, with its header; empty: none.
  [[nodiscard]] const std::string& last_image() const { return last_image_; }

 private:
  web::Address address_;
  web::RawClient client_;
  bool is_open_ = false;
  std::string last_image_;
};

}  // namespace twocone::viewer

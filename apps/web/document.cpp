// SPDX-License-Identifier: Apache-2.0
#include "apps/web/document.h"

#include <array>

#include <nlohmann/json.hpp>

namespace twocone::web {

extern const std::string_view kPage;  // apps/web/page, inlined by embed.cmake

namespace {

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

/// Returns JSON that can stand in a <script> element: no text in it ends that element, or opens a comment.
std::string script_text(const nlohmann::ordered_json& data) {
  std::string result;
  for (const char c : data.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)) {
    if (c == '<') {
      result += "\\u003c";
    } else {
      result += c;
    }
  }
  return result;
}

}  // namespace

std::string document(const nlohmann::ordered_json& data, std::string_view title, std::string_view plain_text) {
  std::string result;
  std::string_view rest = kPage;
  const std::array<std::pair<std::string_view, std::string>, 3> parts{
      {{"@TITLE@", escaped(title)}, {"@PLAIN@", escaped(plain_text)}, {"@DATA@", script_text(data)}}};
  for (const auto& [mark, text] : parts) {
    const std::size_t at = rest.find(mark);
    result.append(rest.substr(0, at)).append(text);
    rest.remove_prefix(at + mark.size());
  }
  return result.append(rest);
}

}  // namespace twocone::web

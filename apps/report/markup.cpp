// SPDX-License-Identifier: Apache-2.0
#include "apps/report/markup.h"

#include <algorithm>
#include <array>
#include <cctype>

namespace twocone::report {
namespace {

/// Length of the well-formed UTF-8 character (RFC 3629) at the start of `text`; 0 if there is none.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const auto in = [](unsigned value, unsigned low, unsigned high) { return value >= low && value <= high; };
  const auto tail = [&](std::size_t i) { return in(byte(i), 0x80, 0xBF); };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  if (in(first, 0xC2, 0xDF)) return tail(1) ? 2 : 0;
  if (in(first, 0xE0, 0xEF)) {
    const unsigned low = first == 0xE0 ? 0xA0 : 0x80;
    const unsigned high = first == 0xED ? 0x9F : 0xBF;
    return in(byte(1), low, high) && tail(2) ? 3 : 0;
  }
  if (in(first, 0xF0, 0xF4)) {
    const unsigned low = first == 0xF0 ? 0x90 : 0x80;
    const unsigned high = first == 0xF4 ? 0x8F : 0xBF;
    return in(byte(1), low, high) && tail(2) && tail(3) ? 4 : 0;
  }
  return 0;
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

}  // namespace

std::string cleaned(std::string_view text) {
  constexpr std::string_view kReplacement = "\xEF\xBF\xBD";
  std::string clean;
  clean.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
    const bool control =
        length == 1 && static_cast<unsigned char>(character[0]) < 0x20 && character != "\n" && character != "\t";
    // U+FFFE and U+FFFF are characters to UTF-8 but not to XML.
    const bool bad = length == 0 || character == "\xEF\xBF\xBE" || character == "\xEF\xBF\xBF";
    if (!control) clean += bad ? kReplacement : character;
    text.remove_prefix(character.size());
  }
  return clean;
}

std::string escape(std::string_view text) {
  std::string safe;
  for (const char c : cleaned(text)) {
    if (c == '&') {
      safe += "&amp;";
    } else if (c == '<') {
      safe += "&lt;";
    } else if (c == '>') {
      safe += "&gt;";
    } else if (c == '"') {
      safe += "&quot;";
    } else if (c == '\'') {
      safe += "&#39;";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string base64(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t there = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8U | (k < there ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= there ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

std::string data_uri(std::string_view mime, std::span<const std::uint8_t> bytes) {
  return "data:" + std::string(mime) + ";base64," + base64(bytes);
}

std::string slug(std::string_view name) {
  constexpr std::size_t kLongest = 32;
  std::string safe;
  for (const char c : name.substr(0, kLongest)) {
    const auto byte = static_cast<unsigned char>(c);
    safe += byte < 0x80 && std::isalnum(byte) != 0 ? static_cast<char>(std::tolower(byte)) : '_';
  }
  return safe.empty() ? "_" : safe;
}

std::string inline_svg(std::string_view svg, std::string_view prefix) {
  const std::size_t root = svg.find("<svg");
  std::string text{root == std::string_view::npos ? svg : svg.substr(root)};
  // The ways in which gnuplot and we name and use things inside an SVG.
  for (const std::string_view use : {"id='", "id=\"", "href='#", "href=\"#", "url(#"}) {
    // " id=" so as not to touch an attribute that only ends in "id"; the others cannot be mistaken.
    std::string from = use.starts_with("id") ? " " : "";
    from += use;
    std::string to = from;
    to.append(prefix).append("_");
    text = replaced(std::move(text), from, to);
  }
  return text;
}

}  // namespace twocone::report

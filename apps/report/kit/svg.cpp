// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/svg.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/report/kit/plain_text.h"

namespace twocone::report {
namespace {

int srgb_code(double linear) {
  const double value = std::isfinite(linear) ? std::clamp(linear, 0.0, 1.0) : 0.0;
  const double coded = value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1 / 2.4) - 0.055;  // IEC 61966-2-1
  return int(std::lround(255 * coded));
}

std::string_view entity_of(std::string_view character) {
  if (character == "&") return "&amp;";
  if (character == "<") return "&lt;";
  if (character == ">") return "&gt;";
  if (character == "\"") return "&quot;";
  if (character == "'") return "&#39;";
  return character;
}

}  // namespace

std::string escape(std::string_view text) {
  constexpr std::string_view kReplacement = "\xEF\xBF\xBD";
  std::string safe;
  safe.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
    const bool control =
        length == 1 && static_cast<unsigned char>(character[0]) < 0x20 && character != "\n" && character != "\t";
    // U+FFFE and U+FFFF are characters to UTF-8 but not to XML.
    const bool bad = length == 0 || character == "\xEF\xBF\xBE" || character == "\xEF\xBF\xBF";
    if (!control) safe += bad ? kReplacement : entity_of(character);
    text.remove_prefix(character.size());
  }
  return safe;
}

std::string own_colour(const std::array<double, 3>& colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", srgb_code(colour[0]), srgb_code(colour[1]), srgb_code(colour[2]));
}

}  // namespace twocone::report

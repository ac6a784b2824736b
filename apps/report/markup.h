// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace twocone::report {

/// Returns `text` without what XML forbids: control characters are left out, bytes that are not UTF-8 become U+FFFD.
std::string cleaned(std::string_view text);

/// Returns `text` for an XML or HTML text node or a quoted attribute: cleaned, with & < > " ' as entities.
std::string escape(std::string_view text);

/// Returns the base64 encoding of RFC 4648, padded.
std::string base64(std::span<const std::uint8_t> bytes);

/// Returns "data:image/jpeg;base64,...".
/// @param mime such as "image/jpeg"
std::string data_uri(std::string_view mime, std::span<const std::uint8_t> bytes);

/// Returns `name` as a part of a file name: letters in lower case, digits and '_' stay, every other character becomes
/// '_'; at most 32 characters.
std::string slug(std::string_view name);

/// Returns a stand-alone SVG as part of a page: without its prolog, and with `prefix` in front of its identifiers, so
/// that several can stand on one page.
std::string inline_svg(std::string_view svg, std::string_view prefix);

}  // namespace twocone::report

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace twocone::report {

/// `text` with what XML does not know put right: control characters left out, bytes that are not UTF-8 replaced by
/// U+FFFD.
std::string cleaned(std::string_view text);

/// `text` for an XML or HTML text node or a quoted attribute: cleaned, and & < > " ' as entities.
std::string escape(std::string_view text);

/// RFC 4648, padded.
std::string base64(std::span<const std::uint8_t> bytes);

/// "data:image/jpeg;base64,..." @param mime as "image/jpeg"
std::string data_uri(std::string_view mime, std::span<const std::uint8_t> bytes);

/// Letters, digits and '_' of `name` in lower case, the rest as '_'; at most 32: for a file's name.
std::string slug(std::string_view name);

/// A stand-alone SVG as part of a page: without its prolog, its identifiers made unique by `prefix`, so that several
/// stand side by side.
std::string inline_svg(std::string_view svg, std::string_view prefix);

}  // namespace twocone::report

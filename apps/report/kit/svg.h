// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>

/// Parts of SVG files.
namespace twocone::report {

/// Returns `text` for an XML text node or a quoted attribute, with & < > " ' as entities. Control characters are left
/// out, and bytes that are not UTF-8 become U+FFFD.
std::string escape(std::string_view text);

/// Returns a landmark's own colour: "#rrggbb", sRGB. @param colour linear rgb, limited to [0, 1]
std::string own_colour(const std::array<double, 3>& colour);

}  // namespace twocone::report

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace cv {
class Mat;
}

namespace twocone::report {

/// Returns `text` without what XML forbids: control characters are left out, bytes that are not UTF-8 become U+FFFD.
std::string cleaned(std::string_view text);

/// Returns `text` for an XML or HTML text node or a quoted attribute: cleaned, with & < > " ' as entities.
std::string escape(std::string_view text);

/// Returns `text` with every `from` replaced by `to`.
std::string replaced(std::string text, std::string_view from, std::string_view to);

/// Returns the base64 encoding of RFC 4648, padded.
std::string base64(std::span<const std::uint8_t> bytes);

/// Returns `image` (CV_8UC3 b g r) as "data:image/jpeg;base64,...". @param quality of the JPEG, 0 to 100
std::string jpeg_uri(const cv::Mat& image, int quality);

/// Returns an SVG's element for an image that is stretched into a rectangle.
std::string svg_image(double x, double y, double width, double height, std::string_view uri);

/// Returns `name` as a part of a file name: letters in lower case, digits and '_' stay, every other character becomes
/// '_'; at most 32 characters.
std::string slug(std::string_view name);

/// Returns a stand-alone SVG as part of a page: without its prolog, and with `prefix` in front of its identifiers, so
/// that several can stand on one page.
std::string inline_svg(std::string_view svg, std::string_view prefix);

}  // namespace twocone::report

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/image.h"

namespace twocone::report {

/// Returns `text` as valid XML characters: control characters are left out, and bytes that are not UTF-8 become U+FFFD.
std::string cleaned(std::string_view text);

/// Returns `text` for an XML or HTML text node or a quoted attribute: cleaned, with & < > " ' as entities.
std::string escape(std::string_view text);

/// Returns the base64 encoding of RFC 4648, padded.
std::string base64(std::span<const std::uint8_t> bytes);

/// Returns `image` as "data:image/jpeg;base64,...". @param quality as of to_mjpeg. @throws base::FormattedError as it
std::string jpeg_uri(const Image& image, int quality);

/// Returns the SVG element of an image that is stretched into a rectangle.
std::string svg_image(double x, double y, double width, double height, std::string_view uri);

/// Returns `name` as a part of a file name, at most 32 characters: letters become lower case, digits and '_' stay, and
/// every other character becomes '_'.
std::string slug(std::string_view name);

/// Returns a stand-alone SVG as part of a page: without its prolog, and with `prefix` in front of its identifiers, so
/// that several can stand on one page.
std::string inline_svg(std::string_view svg, std::string_view prefix);

/// Returns the style sheet of every page.
std::string_view style();

/// Returns the page's script, which moves the slider through the frames. Without it the page shows the first frame.
std::string_view script();

}  // namespace twocone::report

/// Small pieces of HTML that are also well-formed XML. "Inner" is HTML that is inserted unchanged; "text" is plain text
/// that is escaped.
namespace twocone::report::html {

/// Returns <tag attributes>inner</tag>. @param attributes HTML, such as `class="note"`; may be empty
std::string element(std::string_view tag, std::string_view inner, std::string_view attributes = "");

/// Returns <tag attributes>text</tag>.
std::string text(std::string_view tag, std::string_view plain, std::string_view attributes = "");

/// Returns <section id="id"> with a heading.
std::string section(std::string_view id, std::string_view title, std::string_view inner);

/// Returns a list of plain sentences. Without sentences, it returns a paragraph with the plain text `nothing`, or ""
/// if that is empty.
std::string list(const std::vector<std::string>& sentences, std::string_view nothing = "");

/// Returns a list of names and values (dl), both plain text.
std::string facts(const std::vector<std::pair<std::string, std::string>>& facts);

/// Returns one of the frames that script() shows one at a time. @param name plain text. @param first the one shown
/// first
std::string shown_frame(std::string_view inner, std::string_view name, bool first);

/// A table that scrolls sideways by itself on a narrow screen. Cells are inner HTML; the first cell of a row is its
/// head, the others are numbers.
class Table {
 public:
  /// @param caption plain text. @param head inner HTML of the rows of the head
  /// @param attributes attributes of the table
  Table(std::string_view caption, std::string_view head, std::string_view attributes = "");
  void add(const std::vector<std::string>& cells, std::string_view attributes = "");
  [[nodiscard]] std::string str() const;

 private:
  std::string caption_, head_, attributes_, body_;
};

/// Returns links to parts of the page. @param places id and title of each part
std::string navigation(const std::vector<std::pair<std::string, std::string>>& places);

/// Returns the whole page: UTF-8, and well-formed XML if its parts are. @param title plain text. @param style,script
/// inserted unchanged, without < and &. @param body inner HTML
std::string document(std::string_view title, std::string_view style, std::string_view body, std::string_view script);

/// Returns a row of a table's head. @param cells inner HTML. @param spans columns of each cell; empty: one each
std::string head_row(const std::vector<std::string>& cells, const std::vector<int>& spans = {});

}  // namespace twocone::report::html

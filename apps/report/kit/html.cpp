// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/html.h"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>
#include <boost/algorithm/string/replace.hpp>

#include "apps/report/kit/plain_text.h"
#include "base/errors.h"

namespace twocone::report {

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
  std::string safe = cleaned(text);
  // The ampersand comes first, because the others put new ones in.
  for (const auto& [raw, entity] :
       {std::pair{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}, {"'", "&#39;"}}) {
    boost::replace_all(safe, raw, entity);
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

std::string jpeg_uri(const Image& image, int quality) {
  const auto jpeg = to_mjpeg(image, quality);
  if (!jpeg) throw base::FormattedError("{}", jpeg.error().message);
  return "data:image/jpeg;base64," + base64({jpeg->bytes.data(), jpeg->bytes.size()});
}

std::string svg_image(double x, double y, double width, double height, std::string_view uri) {
  return fmt::format(
      "<image x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" preserveAspectRatio=\"none\" "
      "xlink:href=\"{}\"/>\n",
      x, y, width, height, uri);
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
  // " id=" so as not to touch an attribute that only ends in "id"; the others cannot be mistaken.
  for (const char* const use : {" id='", " id=\"", "href='#", "href=\"#", "url(#"}) {
    boost::replace_all(text, use, fmt::format("{}{}_", use, prefix));
  }
  return text;
}

namespace html {

std::string element(std::string_view tag, std::string_view inner, std::string_view attributes) {
  return fmt::format("<{0}{1}{2}>{3}</{0}>\n", tag, attributes.empty() ? "" : " ", attributes, inner);
}

std::string text(std::string_view tag, std::string_view plain, std::string_view attributes) {
  return element(tag, escape(plain), attributes);
}

std::string section(std::string_view id, std::string_view title, std::string_view inner) {
  return element("section", text("h2", title) + std::string(inner), fmt::format("id=\"{}\"", escape(id)));
}

std::string list(const std::vector<std::string>& sentences, std::string_view nothing) {
  if (sentences.empty()) return nothing.empty() ? "" : text("p", nothing);
  std::string items;
  for (const std::string& sentence : sentences) items += text("li", sentence);
  return element("ul", items);
}

std::string facts(const std::vector<std::pair<std::string, std::string>>& facts) {
  std::string items;
  for (const auto& [name, value] : facts) items += text("dt", name) + text("dd", value);
  return element("dl", items);
}

std::string shown_frame(std::string_view inner, std::string_view name, bool first) {
  return element("div", inner,
                 fmt::format("class=\"frame\" data-name=\"{}\"{}", escape(name), first ? "" : " hidden=\"hidden\""));
}

Table::Table(std::string_view caption, std::string_view head, std::string_view attributes)
    : caption_(escape(caption)), head_(head), attributes_(attributes) {}

void Table::add(const std::vector<std::string>& cells, std::string_view attributes) {
  std::string row;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    row += i == 0 ? element("th", cells[i], "scope=\"row\"") : element("td", cells[i]);
  }
  body_ += element("tr", row, attributes);
}

std::string Table::str() const {
  return element(
      "div",
      element("table", element("caption", caption_) + element("thead", head_) + element("tbody", body_), attributes_),
      "class=\"scroll\"");
}

std::string navigation(const std::vector<std::pair<std::string, std::string>>& places) {
  std::string links;
  for (const auto& [id, title] : places) links += text("a", title, fmt::format("href=\"#{}\"", escape(id)));
  return element("nav", links);
}

std::string document(std::string_view title, std::string_view style, std::string_view body, std::string_view script) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n" +
         text("title", title) + element("style", style) + "</head>\n<body>\n" + std::string(body) +
         element("script", script) + "</body>\n</html>\n";
}

std::string head_row(const std::vector<std::string>& cells, const std::vector<int>& spans) {
  std::string row;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    row += element("th", cells[i],
                   i < spans.size() ? fmt::format("scope=\"colgroup\" colspan=\"{}\"", spans[i]) : "scope=\"col\"");
  }
  return element("tr", row);
}

}  // namespace html
}  // namespace twocone::report

// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/html.h"

#include <fmt/format.h>

#include "apps/report/kit/markup.h"

namespace twocone::report::html {

std::string element(std::string_view tag, std::string_view inner, std::string_view attributes) {
  return fmt::format("<{0}{1}{2}>{3}</{0}>\n", tag, attributes.empty() ? "" : " ", attributes, inner);
}

std::string text(std::string_view tag, std::string_view plain, std::string_view attributes) {
  return element(tag, escape(plain), attributes);
}

std::string section(std::string_view id, std::string_view title, std::string_view inner) {
  return element("section", text("h2", title) + std::string(inner), fmt::format("id=\"{}\"", escape(id)));
}

std::string list(const std::vector<std::string>& sentences) {
  if (sentences.empty()) return "";
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

}  // namespace twocone::report::html

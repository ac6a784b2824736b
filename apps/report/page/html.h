// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Small pieces of HTML, written so that the page is well-formed XML as well. "Inner" is HTML that stands as it is;
/// "text" is plain and gets escaped.
namespace twocone::report::html {

/// <tag attributes>inner</tag>. @param attributes HTML, as `class="note"`; may be empty
std::string element(std::string_view tag, std::string_view inner, std::string_view attributes = "");

/// The same around plain text.
std::string text(std::string_view tag, std::string_view plain, std::string_view attributes = "");

/// <section id="id"> with a heading.
std::string section(std::string_view id, std::string_view title, std::string_view inner);

/// A list of plain sentences; empty for none.
std::string list(const std::vector<std::string>& sentences);

/// A table, scrolling sideways by itself on a narrow screen. Cells are inner HTML; the first of a row is its head, the
/// others are numbers.
class Table {
 public:
  /// @param caption plain text. @param head inner HTML of the head's rows
  /// @param attributes of the table
  Table(std::string_view caption, std::string_view head, std::string_view attributes = "");
  void add(const std::vector<std::string>& cells, std::string_view attributes = "");
  [[nodiscard]] std::string str() const;

 private:
  std::string caption_, head_, attributes_, body_;
};

/// Links to parts of the page. @param places id and title of each
std::string navigation(const std::vector<std::pair<std::string, std::string>>& places);

/// The whole page: UTF-8, well-formed XML if its parts are. @param title plain text. @param style, script as they
/// stand, without < and &. @param body inner HTML
std::string document(std::string_view title, std::string_view style, std::string_view body, std::string_view script);

/// A head's row. @param cells inner HTML. @param spans columns of each; empty: one each
std::string head_row(const std::vector<std::string>& cells, const std::vector<int>& spans = {});

}  // namespace twocone::report::html

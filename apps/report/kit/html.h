// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Small pieces of HTML, written so that the page is also well-formed XML. "Inner" names HTML that is inserted
/// unchanged; "text" names plain text that gets escaped.
namespace twocone::report::html {

/// Returns <tag attributes>inner</tag>. @param attributes HTML, such as `class="note"`; may be empty
std::string element(std::string_view tag, std::string_view inner, std::string_view attributes = "");

/// Returns the same element around plain text.
std::string text(std::string_view tag, std::string_view plain, std::string_view attributes = "");

/// Returns <section id="id"> with a heading.
std::string section(std::string_view id, std::string_view title, std::string_view inner);

/// Returns a list of plain sentences; empty if there are none.
std::string list(const std::vector<std::string>& sentences);

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

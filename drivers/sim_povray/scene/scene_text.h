// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

/// Tokens of POV-Ray's scene language. The behaviour of POV-Ray 3.7 was measured, not only read:
///  - block comments nest, `//*` inside one opens another, `/*/` does not close, a line comment inside one is ignored;
///  - in strings a backslash takes the next character with it, in file names too, and a string may span lines;
///  - a lone carriage return ends a line; a byte-order mark in front and a Ctrl-Z at the end are ignored;
///  - `#` and its word may be separated; comments and strings are parsed in skipped branches too.
namespace twocone::sim_povray {

/// A position in a text, counted as in an editor: from 1, columns in characters.
struct Place {
  std::size_t offset = 0;
  int line = 1;
  int column = 1;
};

struct Token {
  enum class Kind {
    kWord,  ///< identifier or keyword
    kNumber,
    kString,     ///< with its quotes
    kSymbol,     ///< one character
    kDirective,  ///< `#` and its word; `text` is the word
    kName,       ///< a comment `//*PMName NAME`; `text` is NAME
    kEnd,        ///< of the text
  };
  Kind kind = Kind::kEnd;
  std::string_view text;
  Place place;

  [[nodiscard]] bool is(char symbol) const { return kind == Kind::kSymbol && text.front() == symbol; }
};

/// An error in a text, and its position.
struct SceneError {
  Place place;
  std::string message;
};

/// Returns the tokens of a text one by one. It skips comments, except for those that name an object. A copy is cheap
/// and serves to read ahead. It holds only a view of the text.
class Lexer {
 public:
  explicit Lexer(std::string_view text);

  /// Returns the next token; kEnd forever after the last. @throws SceneError for a comment or a string without an end
  Token next();

 private:
  [[nodiscard]] char at(std::size_t ahead = 0) const {
    return here_.offset + ahead < text_.size() ? text_[here_.offset + ahead] : '\0';
  }
  [[nodiscard]] bool done() const { return here_.offset >= text_.size(); }
  [[nodiscard]] std::string_view since(std::size_t begin) const { return text_.substr(begin, here_.offset - begin); }
  void step();
  void skip_block_comment();
  std::string_view take_while(bool (*belongs)(char));
  std::string_view take_number();
  std::string_view take_string();
  bool skip_blanks(Token& name);

  std::string_view text_;
  Place here_;
};

/// Kinds of sections, which last to their `#end`.
enum class SectionKind { kIf, kSwitch, kLoop, kMacro };
/// Returns the kind of section that a directive begins: `ifdef` begins a kIf. Nothing: it begins none.
std::optional<SectionKind> section_begun_by(std::string_view directive);

/// POV-Ray's own limit of depth, and a size that no scene reaches. They end the reading of files that include each
/// other.
constexpr std::size_t kDeepestInclude = 32;
constexpr std::size_t kMostIncludedBytes = std::size_t{32} << 20U;

/// The content of an included file.
struct IncludedFile {
  std::string path;
  std::string text;
  bool is_folder = false;
  std::string refusal{};  ///< why a scene may not read it; empty: it may
};
/// Returns the file for the name in an `#include`; nothing: there is no such file.
using IncludeReader = std::function<std::optional<IncludedFile>(const std::string& name)>;

}  // namespace twocone::sim_povray

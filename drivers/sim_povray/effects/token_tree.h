// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <set>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/scene/scene_text.h"

/// A scene's text with its brackets and sections paired, which gives the end of each construct.
namespace twocone::sim_povray {

constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();

/// The tokens of a text, without branches that a literal condition excludes and without name comments. A bracket whose
/// partner depends on a condition or on a macro has none; the same holds for any bracket around it.
struct TokenTree {
  std::vector<Token> tokens;
  /// For `{ ( [` and for a directive that opens a section (#if, #while, #macro, ...): index where it is closed, else
  /// kNowhere.
  std::vector<std::size_t> partner;
  /// Index of the innermost bracket or section that contains a token, else kNowhere.
  std::vector<std::size_t> around;
  /// A bracket is opened here and closed in another file, or the other way round.
  bool leaks = false;
  /// Macros that open or close brackets of their callers, or may do so under some condition.
  std::set<std::string_view> leaky_macros;

  [[nodiscard]] bool is(std::size_t i, char symbol) const { return i < tokens.size() && tokens[i].is(symbol); }
  [[nodiscard]] bool is(std::size_t i, std::string_view word) const {
    return i < tokens.size() && tokens[i].kind == Token::Kind::kWord && tokens[i].text == word;
  }
  [[nodiscard]] bool is_directive(std::size_t i, std::string_view word) const {
    return i < tokens.size() && tokens[i].kind == Token::Kind::kDirective && tokens[i].text == word;
  }
  /// Returns the word before the brace at `i`, else empty.
  [[nodiscard]] std::string_view keyword(std::size_t i) const;
  /// Returns the innermost brace around `i`, also through sections; else kNowhere.
  [[nodiscard]] std::size_t brace_around(std::size_t i) const;
};

/// @throws SceneError for a comment or a string without an end
TokenTree take_apart(std::string_view text);

/// Returns the index behind the expression (number, vector, string, name, call, and operators between them) that begins
/// at `i`; `i` if there is none, or if its end is not certain. Comparisons count only inside parentheses.
std::size_t after_expression(const TokenTree& tree, std::size_t i);

/// A name that `#declare`, `#local` or `#macro` declares, and the tokens that belong to it.
struct Declaration {
  std::size_t name = kNowhere;   ///< the name's token; kNowhere: not a declaration that is understood
  std::size_t value = kNowhere;  ///< the first token that belongs to it
  std::size_t end = kNowhere;    ///< behind its last token, or before that if the end is not certain
};
Declaration declaration(const TokenTree& tree, std::size_t directive);

/// Returns whether the whole expression at `i` is a literal 0.
bool is_zero(const TokenTree& tree, std::size_t i);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <set>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/scene/scene_text.h"

/// A scene's text with its brackets and sections paired: what has to be known to tell where something ends.
namespace twocone::sim_povray {

constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();

/// Branches that a literal condition cuts off are not in it, nor are name comments. A bracket whose partner depends on
/// a condition or on what a macro does has none, nor has any around it.
struct TokenTree {
  std::vector<Token> tokens;
  /// Of `{ ( [` and of a directive that opens a section (#if, #while, #macro, ...): where it is closed, else kNowhere.
  std::vector<std::size_t> partner;
  /// The innermost bracket or section that a token stands in, as the index of what opens it, else kNowhere.
  std::vector<std::size_t> around;
  /// Something is opened here and closed in another file, or the other way round.
  bool leaks = false;
  /// Macros that do that to whoever calls them, or may do it under some condition.
  std::set<std::string_view> leaky_macros;

  [[nodiscard]] bool is(std::size_t i, char symbol) const { return i < tokens.size() && tokens[i].is(symbol); }
  [[nodiscard]] bool is(std::size_t i, std::string_view word) const {
    return i < tokens.size() && tokens[i].kind == Token::Kind::kWord && tokens[i].text == word;
  }
  [[nodiscard]] bool is_directive(std::size_t i, std::string_view word) const {
    return i < tokens.size() && tokens[i].kind == Token::Kind::kDirective && tokens[i].text == word;
  }
  /// The word before the brace at `i`, else empty.
  [[nodiscard]] std::string_view keyword(std::size_t i) const;
  /// The innermost brace around `i`, also through sections; else kNowhere.
  [[nodiscard]] std::size_t brace_around(std::size_t i) const;
};

/// @throws SceneError for a comment or a string without an end
TokenTree take_apart(std::string_view text);

/// Behind the expression (number, vector, string, name, call, and operators between them) that begins at `i`; `i` if
/// none does, or its end is not certain. Comparisons count only inside parentheses.
std::size_t after_expression(const TokenTree& tree, std::size_t i);

/// A name that `#declare`, `#local` or `#macro` at `directive` gives, and what belongs to it.
struct Declaration {
  std::size_t name = kNowhere;   ///< the name's token; kNowhere: no declaration that is understood
  std::size_t value = kNowhere;  ///< the first token of what belongs to it
  std::size_t end = kNowhere;    ///< behind its last; where that is not certain, rather too early
};
Declaration declaration(const TokenTree& tree, std::size_t directive);

/// A literal 0 that is all of the expression at `i`.
bool is_zero(const TokenTree& tree, std::size_t i);

}  // namespace twocone::sim_povray

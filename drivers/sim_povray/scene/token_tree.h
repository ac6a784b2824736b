// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/scene/scene_text.h"

/// A scene's text with its brackets and sections paired, without evaluation of anything but literal conditions. The
/// names of blocks, the effects and their switches are all found in it.
namespace twocone::sim_povray {

constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();

/// A block `KEYWORD { //*PMName NAME ... }` that POV-Ray sees, or may see.
struct NamedBlock {
  std::string name;
  std::string keyword;     ///< the word before the brace, empty if there is none
  Place place;             ///< position of the name comment
  std::size_t begin = 0;   ///< offset of the keyword's first letter
  std::size_t close = 0;   ///< offset of the closing brace
  std::string obstacle{};  ///< why a program cannot move it; empty if it can
};

struct SceneOutline {
  std::vector<NamedBlock> blocks;
  /// A name comment that is not the first thing inside a block's braces, and therefore names nothing.
  struct Stray {
    std::string name;
    Place place;
  };
  std::vector<Stray> strays;
};

/// The tokens of a text, without branches that a literal condition excludes and without name comments.
///
/// A bracket whose partner depends on a condition or on a macro has none; the same holds for any bracket around it. For
/// the outline, the braces of the first branch of a condition count; those of a loop count once, and those of a macro
/// at each call.
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
  SceneOutline outline;
  /// The first comment, string, brace or directive without its partner: POV-Ray refuses a scene with such a text.
  std::optional<SceneError> fault;
  /// The comment or string without an end, where the tokens end.
  std::optional<SceneError> unfinished;

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

/// Returns the tree of a text, which must outlive it.
TokenTree take_apart(std::string_view text);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "drivers/sim_povray/scene/token_tree.h"

/// Finds in a scene's tokens where an expression or a declaration ends, without evaluating it.
namespace twocone::sim_povray {

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

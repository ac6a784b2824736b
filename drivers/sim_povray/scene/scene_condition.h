// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/sim_povray/scene/scene_text.h"

/// Which branches of `#if` and its kin a text can have, without evaluating it.
namespace twocone::sim_povray {

enum class Truth { kFalse, kTrue, kUnknown };

/// What a condition right after its directive evaluates to, if it is a literal: (0), (1), ((-2.5)), (false), (yes), ...
Truth literal_condition(Lexer ahead);

/// The branches of one `#if` or `#switch`, entered one after the other.
struct Branches {
  Truth reached = Truth::kTrue;  ///< whether the present branch's condition is asked at all
  bool dead = false;             ///< the present branch is cut off for sure
  bool uncertain = false;        ///< the present branch may or may not be taken, or more than once

  void enter(Truth condition);
};

}  // namespace twocone::sim_povray

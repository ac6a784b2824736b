// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "drivers/sim_povray/scene/scene_text.h"

/// Finds which branches of `#if` and similar directives a text can have, without evaluating it.
namespace twocone::sim_povray {

/// Kinds of sections, which last to their `#end`.
enum class SectionKind { kIf, kSwitch, kLoop, kMacro };
/// Returns the kind of section that a directive begins: `ifdef` begins a kIf. Nothing: it begins none.
std::optional<SectionKind> section_begun_by(std::string_view directive);

enum class Truth { kFalse, kTrue, kUnknown };

/// Returns the value of the condition right after its directive if it is a literal: (0), (1), ((-2.5)), (false), (yes),
/// ...; else kUnknown.
Truth literal_condition(Lexer ahead);

/// The branches of one `#if` or `#switch`, entered one after the other.
struct Branches {
  Truth reached = Truth::kTrue;  ///< whether the present branch's condition is evaluated at all
  bool dead = false;             ///< the present branch is certainly not taken
  bool uncertain = false;        ///< the present branch may or may not be taken, or is taken more than once

  void enter(Truth condition);
};

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/scene/scene_text.h"

namespace twocone::sim_povray {

/// A block `KEYWORD { //*PMName NAME ... }` that POV-Ray sees, or may see.
struct NamedBlock {
  std::string name;
  std::string keyword;    ///< the word before the brace, empty if there is none
  Place place;            ///< position of the name comment
  std::size_t begin = 0;  ///< offset of the keyword's first letter
  std::size_t close = 0;  ///< offset of the closing brace
  std::string obstacle;   ///< why a program cannot move it; empty if it can
};

struct SceneOutline {
  std::vector<NamedBlock> blocks;
  /// A name comment that is not the first thing inside a block's braces, and so names nothing.
  struct Stray {
    std::string name;
    Place place;
  };
  std::vector<Stray> strays;
};

/// Finds the named blocks of a scene without evaluating it.
///
/// Branches that a literal condition (`#if (0)`, `#elseif (false)`) excludes are ignored. For a condition that needs
/// evaluating, the braces of its first branch count; those of a loop count once, and those of a macro at each call.
/// @throws SceneError for a comment, string, brace or directive without its partner
SceneOutline outline(std::string_view text);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/scene/evaluated_scene.h"
#include "drivers/sim_povray/scene/scene_text.h"
#include "hal/result.h"

/// Evaluates a scene's text: declarations, macros, conditions, loops and expressions.
namespace twocone::sim_povray {

/// What a lenient evaluation did not take as the text says.
struct Leniency {
  /// Statements that are left out: `FILE:LINE: why`. Each place is named once. At most a hundred are listed.
  std::vector<std::string> left_out{};
  /// Shapes in place of which a simple one around them stands (Object::is_bound), likewise.
  std::vector<std::string> bounded{};
};

struct EvaluatorSettings {
  /// `transform { PREFIX X0 }` and so on (without the blank) stand for the poses of blocks 0, 1, ..., and
  /// `transform { PREFIX V }` for that of the view. Empty: the scene has none.
  std::string pose_prefix{};
  int width_px = 640;  ///< `image_width`; 0: not known, and a scene that asks for it is refused
  int height_px = 480;
  std::size_t most_tokens = 20'000'000;  ///< that are evaluated, each time that they are
  std::size_t most_objects = 1'000'000;  ///< with their parts and copies: half a gigabyte
  /// Not null: for a question about shapes and their places only. Lights are not read. A pigment that is not supported
  /// has no entries. An object that is not supported is left out and named here; only a text without structure is an
  /// error.
  Leniency* leniency = nullptr;
};

/// Object::mover of what moves with the view.
constexpr int kViewMover = -2;

/// Evaluates a scene. The supported language is that of the scenes in scenes/ and of docs/renderers.md.
/// A declaration that uses anything else is an error only where something visible uses the declaration.
/// Errors: kRefused, `FILE:LINE: why`: the text uses a construct that is not supported (the message names the keyword),
/// is wrong, or does not end or grows without end (limits of tokens, objects, strings, depth of macros and of
/// includes).
[[nodiscard]] Result<EvaluatedScene> evaluate(std::string_view text, const std::string& path, const IncludeReader& read,
                                              const EvaluatorSettings& settings);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/render/povray/scene_access.h"
#include "drivers/sim_povray/scene/scene.h"

/// Finds the rendering effects that a scene's text uses, changes the text to do without them, and chooses how the scene
/// is rendered: with all effects that it uses and no others.
namespace twocone::sim_povray {

enum class Feature {
  kReflection,    ///< `reflection`
  kShadows,       ///< a light source that is not `shadowless`
  kTransparency,  ///< filter, transmit, rgbf, rgbt, rgbft, refraction, ior
  kAreaLights,
  kMedia,  ///< media, fog
  kPhotons,
  kRadiosity,
  kSubsurface,
  kRandom,       ///< jitter, crand: random numbers, drawn in the order in which POV-Ray renders pixels
  kFrameNumber,  ///< frame_number, clock_on and similar: the scene asks which frame of an animation it is
};

/// POV-Ray's default for max_trace_level.
constexpr int kUsualReflectionDepth = 5;

/// A position in a file that uses a feature.
struct Call {
  Feature feature{};
  std::string file;
  int line = 0;
  std::string word;
  bool included = false;  ///< it is in a file that the scene includes
  std::size_t offset = 0;

  [[nodiscard]] std::string place() const;  ///< `scenes/lab.pov:76`
};

/// A string literal, which may be the name of a file to be read.
struct WrittenString {
  std::string file;  ///< file that contains it
  int line = 0;
  std::string text;
};

/// Effects that a scene uses. A declaration with a name that nothing uses does not count.
struct SceneCalls {
  std::vector<Call> all;               ///< in the order in which POV-Ray reads them
  std::optional<int> max_trace_level;  ///< the evaluated value, else the last that is written as a literal
  std::vector<std::string> unread;     ///< includes that could not be read, `FILE:LINE: why`: their effects are unknown
  /// An include that POV-Ray would read without end, such as a folder: `FILE:LINE: why`. Empty: none.
  std::string endless;
  std::vector<WrittenString> strings;  ///< all except files to be written, in the order in which POV-Ray reads them
  std::vector<std::string> folders;    ///< folders of included files that `access` does not search, each once

  /// Returns the first use of `feature`; nullptr: none.
  [[nodiscard]] const Call* find(Feature feature) const;
};

/// Reads the tokens of the scene, and of the files that it includes and may read, without evaluating them. Included
/// files are searched for where `access` states, and beside files that are already included. Text in a comment, a
/// string or a branch that a literal `#if (0)` excludes does not count; neither does a declaration or macro that live
/// text never names. In doubt, an effect counts as used. An include whose name is not a literal, or which cannot be
/// read, is reported in `unread`.
/// If the scene can be evaluated (evaluator.h), words in branches that are not taken do not count either, and
/// max_trace_level is evaluated.
[[nodiscard]] SceneCalls find_calls(const Scene& scene, const SceneAccess& access);
/// Does the same for a text, with `read` in place of the disk and without evaluation. If the text is not finished, only
/// the part before its last comment or string counts.
[[nodiscard]] SceneCalls find_calls(std::string_view text, const std::string& path, const IncludeReader& read);

/// Returns the scene's text without the effects that `switches` switch off. Line numbers stay the same, but offsets do
/// not, so the result must be parsed again. Only the text itself is changed, not the files that it includes.
/// Errors: kRefused, with file and line: an effect to be switched off is, or may be, in an include; or its end is not
/// certain.
[[nodiscard]] Result<std::string> switched(const Scene& scene, const SceneCalls& calls, const SceneSwitches& switches);

/// POV-Ray's +Q for a scene without media, fog, photons, radiosity and subsurface light: 8 leaves out these and nothing
/// else, so that the pixels are those of 9 (tests/sim_povray/effects_test.cpp checks it). Levels above 9 add nothing.
constexpr int kPlainQuality = 8;
constexpr int kFullQuality = 9;

struct RenderChoice {
  Scene scene;       ///< without the effects that are switched off; its lines are those of the file
  SceneCalls calls;  ///< effects that this scene uses
  int quality = kFullQuality;
  /// Why the pixels outside the mirror must be rendered too, as whole_image does: POV-Ray's result for a pixel depends
  /// on the pixels that it rendered before. Empty: they need not be.
  std::string why_whole{};
  /// Why a process cannot be held between images: the scene asks, or may ask, which frame of an animation it is, or has
  /// photons, which POV-Ray carries over from one image to the next. Empty: it can.
  std::string one_shot{};
};

/// Chooses how the scene is rendered. Errors: kRefused, as switched().
[[nodiscard]] Result<RenderChoice> choose_rendering(const Scene& scene, const SceneSwitches& switches,
                                                    const SceneAccess& access);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/render/scene_access.h"
#include "drivers/sim_povray/scene/scene.h"
#include "drivers/sim_povray/sim_povray.h"

/// Which rendering effects a scene's text calls for, and how its text is changed to do without.
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
  kRandom,       ///< jitter, crand: numbers are drawn in the order in which POV-Ray makes pixels
  kFrameNumber,  ///< frame_number, clock_on and their kin: the scene asks which frame of an animation it is
};

/// A place that calls for a feature.
struct Call {
  Feature feature{};
  std::string file;
  int line = 0;
  std::string word;
  bool included = false;  ///< it stands in a file that the scene includes

  [[nodiscard]] std::string place() const;  ///< `scenes/lab.pov:76`
};

/// A string literal, which may be the name of a file to be read.
struct WrittenString {
  std::string file;  ///< that holds it
  int line = 0;
  std::string text;
};

/// What is declared, but by a name that nothing uses, calls for nothing.
struct SceneCalls {
  std::vector<Call> all;               ///< in the order in which POV-Ray reads them
  std::optional<int> max_trace_level;  ///< the last that is written as a literal
  std::vector<std::string> unread;     ///< includes that could not be read, `FILE:LINE: why`: their calls are not known
  /// An include that POV-Ray would read without end, as it does a folder: `FILE:LINE: why`. Empty: none.
  std::string endless;
  std::vector<WrittenString> strings;  ///< all but files to be written, in the order in which POV-Ray reads them
  std::vector<std::string> folders;    ///< of included files that are not where `access` looks, each once

  /// The first that calls for `feature`; nullptr: none does.
  [[nodiscard]] const Call* find(Feature feature) const;
};

/// The content of a file by the name in an `#include`; nothing: there is no such file.
struct IncludedFile {
  std::string path;
  std::string text;
  bool is_folder = false;
};
using IncludeReader = std::function<std::optional<IncludedFile>(const std::string& name)>;

/// Reads the scene's tokens, and those of the files it includes and may read (looked for where `access` says, and
/// beside files that are included already), without evaluating them: what stands in a comment, a string or a branch
/// that a literal `#if (0)` cuts off calls for nothing; what stands in a declaration or macro that is never named in
/// live text neither. When in doubt, it calls. An include whose name is no literal or that cannot be read is told of in
/// `unread`.
[[nodiscard]] SceneCalls find_calls(const Scene& scene, const SceneAccess& access);
/// The same for a text, with `read` in place of the disk. A text that is not finished calls for nothing from where its
/// last comment or string begins.
[[nodiscard]] SceneCalls find_calls(std::string_view text, const std::string& path, const IncludeReader& read);

/// The scene's text without what `switches` switch off. Line numbers stay what they are; offsets do not: parse it anew.
/// Works on the text itself, not on what it includes.
/// Errors: kRefused, with file and line: an effect to be switched off stands, or may stand, in an include; or where it
/// ends is not certain.
[[nodiscard]] Result<std::string> switched(const Scene& scene, const SceneCalls& calls, const SceneSwitches& switches);

}  // namespace twocone::sim_povray

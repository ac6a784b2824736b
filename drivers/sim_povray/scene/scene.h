// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/sim_povray/scene/scene_outline.h"
#include "drivers/sim_povray/world/motion.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// A named block of the scene together with how far it has moved since the scene was written.
struct Moved {
  NamedBlock block;
  FloorMotion motion;
};

/// A POV-Ray file as it was when it was read. Errors name it as `path` was given: `lab.pov:42:17: ...`.
class Scene {
 public:
  /// Errors: kNotFound (no such file), kRefused (no readable file; or its text, with line and column).
  static Result<Scene> read(const std::filesystem::path& path);
  /// Errors: kRefused. @param path for messages only
  static Result<Scene> parse(std::string text, std::string path);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& text() const { return text_; }

  /// The one object (camera) of that name. Errors: kRefused: none, several, no object (camera), or one that cannot be
  /// moved.
  [[nodiscard]] Result<NamedBlock> object(const std::string& name) const;
  [[nodiscard]] Result<NamedBlock> camera(const std::string& name) const;

  /// The scene with `moved` carried to where they are and seen by `view`. No line is added before the end, so that
  /// POV-Ray's line numbers are those of the file.
  /// @param unit_m metres in one POV-Ray unit
  [[nodiscard]] std::string seen(const std::vector<Moved>& moved, const Moved& view, double unit_m) const;
  /// The scene as it stands, seen by `camera`: the statement `camera { ... }`.
  [[nodiscard]] std::string seen(const std::string& camera) const;

 private:
  Scene(std::string path, std::string text, SceneOutline found)
      : path_(std::move(path)), text_(std::move(text)), found_(std::move(found)) {}
  [[nodiscard]] Result<NamedBlock> find(const std::string& name, const std::string& keyword,
                                        const std::string& what) const;
  [[nodiscard]] Error refused(const Place& place, const std::string& message) const;

  std::string path_;
  std::string text_;
  SceneOutline found_;
};

/// `motion` as a POV-Ray transformation. World (x, y, z) is POV-Ray <x, z, y> / unit_m; numbers have the fewest digits
/// that read back as the same double.
std::string matrix(const FloorMotion& motion, double unit_m);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/sim_povray/render/picture.h"
#include "drivers/sim_povray/scene/scene_outline.h"
#include "drivers/sim_povray/world/motion.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// A named block of the scene together with how far it has moved since the scene was written.
struct Moved {
  NamedBlock block;
  FloorMotion motion;
};

/// Something to put in at an offset of a scene's text.
struct Insertion {
  std::size_t offset = 0;
  std::string text;
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

  /// Whether anything in the text is named so, movable or not.
  [[nodiscard]] bool mentions(const std::string& name) const;
  /// Of all named blocks, each once, in the order of the text.
  [[nodiscard]] std::vector<std::string> names() const;
  /// The object that a robot of that name is: `robot.NAME`, or `robot` where the scene has no such object.
  /// Errors: kRefused, as object(); and the scene's robots, where it has others.
  [[nodiscard]] Result<NamedBlock> robot(const std::string& name) const;

  /// The one object (camera) of that name. Errors: kRefused: none, several, no object (camera), or one that cannot be
  /// moved.
  [[nodiscard]] Result<NamedBlock> object(const std::string& name) const;
  [[nodiscard]] Result<NamedBlock> camera(const std::string& name) const;

  /// The scene with `moved` carried to where they are and seen by `view`. No line is added before the end, so that
  /// POV-Ray's line numbers are those of the file.
  /// @param unit_m metres in one POV-Ray unit
  [[nodiscard]] std::string seen(const std::vector<Moved>& moved, const Moved& view, double unit_m) const;
  /// The same for many pictures: `moved` and `view` are where pose_text() says. No line is added before the end.
  /// @param mask an object (directives may go before it, line breaks may not) that rides with the view, placed for it
  /// as the scene shows it; empty: none
  [[nodiscard]] Mould mould(const std::vector<NamedBlock>& moved, const NamedBlock& view,
                            const std::string& mask) const;
  /// What a picture's RenderJob::pose is: how far each block of `moved` and the view have gone, in that order.
  [[nodiscard]] std::string pose_text(const std::vector<FloorMotion>& motions, const FloorMotion& view_motion,
                                      double unit_m) const;
  /// The text with insertions, in the order given where they fall together.
  [[nodiscard]] std::string with(std::vector<Insertion> insertions) const;
  /// What identifiers of ours begin with: nothing in the scene does.
  [[nodiscard]] const std::string& prefix() const { return prefix_; }
  /// The scene as it stands, seen by `camera`: the statement `camera { ... }`.
  [[nodiscard]] std::string seen(const std::string& camera) const;

 private:
  Scene(std::string path, std::string text, SceneOutline found);
  [[nodiscard]] Result<NamedBlock> find(const std::string& name, const std::string& keyword,
                                        const std::string& what) const;
  [[nodiscard]] Error refused(const Place& place, const std::string& message) const;

  std::string path_;
  std::string text_;
  SceneOutline found_;
  std::string prefix_;
};

/// `motion` as a POV-Ray transformation. World (x, y, z) is POV-Ray <x, z, y> / unit_m; numbers have the fewest digits
/// that read back as the same double.
std::string matrix(const FloorMotion& motion, double unit_m);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/scene/token_tree.h"
#include "drivers/sim_povray/world/motion.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// Finds the named blocks of a scene without evaluating it (TokenTree).
/// @throws SceneError for a comment, string, brace or directive without its partner
SceneOutline outline(std::string_view text);

/// Text to insert at an offset of a scene's text.
struct Insertion {
  std::size_t offset = 0;
  std::string text;
};

/// The text of a POV-Ray file at the time of reading. Errors name the file by the given `path`: `lab.pov:42:17: ...`.
class Scene {
 public:
  /// Errors: kNotFound (no such file), kRefused (the file is not readable; or its text is wrong, with line and column).
  static Result<Scene> read(const std::filesystem::path& path);
  /// Parses a scene's text. Errors: kRefused. @param path for messages only
  static Result<Scene> parse(std::string text, std::string path);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& text() const { return text_; }

  /// Returns whether anything in the text has this name, movable or not.
  [[nodiscard]] bool mentions(const std::string& name) const;
  /// Returns the names of all named blocks, each once, in the order of the text.
  [[nodiscard]] std::vector<std::string> names() const;
  /// Returns all named blocks, movable or not, in the order of the text.
  [[nodiscard]] const std::vector<NamedBlock>& blocks() const { return found_.blocks; }
  /// Returns the object of the robot of that name: `robot.NAME`, or `robot` if the scene has no such object.
  /// Errors: kRefused, as object(); the message names the scene's robots if it has others.
  [[nodiscard]] Result<NamedBlock> robot(const std::string& name) const;

  /// Returns the one object (camera) of that name. Errors: kRefused: none, several, not an object (camera), or one that
  /// cannot be moved.
  [[nodiscard]] Result<NamedBlock> object(const std::string& name) const;
  [[nodiscard]] Result<NamedBlock> camera(const std::string& name) const;
  /// Returns the camera `name` of a robot that robot() returned: that of `robot.2` has the name `name.2`.
  [[nodiscard]] Result<NamedBlock> camera_of(const NamedBlock& robot, const std::string& name) const;

  /// Returns the scene with `moved` at the poses that pose_text() gives, seen by `view`. No line is added before the
  /// end, so that POV-Ray's line numbers are those of the file.
  /// @param mask an object (directives may precede it, line breaks are not allowed) that moves with the view, placed
  /// for it as the scene shows it; empty: none
  [[nodiscard]] ViewTemplate view_template(const std::vector<NamedBlock>& moved, const NamedBlock& view,
                                           const std::string& mask) const;
  /// Returns an image's RenderJob::pose: the motion of each block of `moved` and of the view, in that order.
  /// @param unit_m metres in one POV-Ray unit
  [[nodiscard]] std::string pose_text(const std::vector<FloorMotion>& motions, const FloorMotion& view_motion,
                                      double unit_m) const;
  /// Returns the text with insertions; insertions at the same offset keep their order.
  [[nodiscard]] std::string with(std::vector<Insertion> insertions) const;
  /// Returns the prefix of the identifiers that this program adds; the scene's text does not contain it.
  [[nodiscard]] const std::string& prefix() const { return prefix_; }

 private:
  Scene(std::string path, std::string text, SceneOutline found);
  [[nodiscard]] Result<NamedBlock> find(const std::string& name, const std::string& keyword,
                                        const std::string& what) const;
  [[nodiscard]] Error refused(const Place& place, const std::string& message) const;
  [[nodiscard]] Error refused(const NamedBlock& block, const char* wanted) const;

  std::string path_;
  std::string text_;
  SceneOutline found_;
  std::string prefix_;
};

/// Returns `motion` as a POV-Ray transformation. World (x, y, z) is POV-Ray <x, z, y> / unit_m; numbers have the fewest
/// digits that read back as the same double.
std::string matrix(const FloorMotion& motion, double unit_m);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/scene/scene_text.h"

namespace twocone::sim_povray {

/// The files that a scene may read, and the folders where POV-Ray searches for those that it names. No text of a scene
/// extends the readable files.
class SceneAccess {
 public:
  /// @param scene_paths folders that are readable with all their sub-folders; empty: the scene's own
  SceneAccess(const std::filesystem::path& scene, const std::vector<std::filesystem::path>& scene_paths);

  /// Returns whether the file, with its links followed, lies below a readable folder, POV-Ray's libraries or the
  /// system's fonts.
  [[nodiscard]] bool may_read(const std::filesystem::path& file) const;
  /// Returns the folders that are readable for the scene: real, absolute paths.
  [[nodiscard]] const std::vector<std::string>& readable() const { return readable_; }

  /// Returns where relative names are searched for, in POV-Ray's order: the scene's folder, POV-Ray's libraries,
  /// scene_paths, and the folders that look_in() added.
  [[nodiscard]] const std::vector<std::filesystem::path>& searched() const { return searched_; }
  /// Also searches the folder of a file that the scene includes, because an included file may name files beside it.
  /// Skips a folder that may not be read or is known.
  void look_in(const std::filesystem::path& folder);
  /// Returns the folders of searched() that POV-Ray needs as options: without the scene's folder and the libraries.
  [[nodiscard]] std::vector<std::filesystem::path> extra_folders() const;

  /// Returns the path of a file as a scene names it, readable or not; empty: there is none.
  [[nodiscard]] std::filesystem::path find(const std::string& name) const;

  /// Returns an addition to a message of POV-Ray about a file that it cannot open: that a scene may not read or write
  /// the file, and the line of the map that allows it. Empty if the message is about something else.
  [[nodiscard]] std::string advice(std::string_view complaint) const;
  /// Returns the message about a file that exists and may not be read.
  [[nodiscard]] static std::string refusal(const std::filesystem::path& file);

 private:
  std::vector<std::string> readable_;
  std::vector<std::filesystem::path> searched_;
  std::size_t libraries_ = 0;  ///< their number in searched_, after the scene's folder
};

/// Returns a function that reads what a scene includes, from where `access` states and from beside the files that it
/// has read. @param access grows by the folders of these files; must outlive the function
[[nodiscard]] IncludeReader include_reader(SceneAccess& access);

/// Returns POV-Ray's system-wide settings file; empty: none is found.
std::string system_ini();
/// Returns the files and folders that the process itself needs: the program, the system's libraries and fonts,
/// POV-Ray's settings and libraries.
std::vector<std::string> needed_to_run(const std::string& program);

}  // namespace twocone::sim_povray

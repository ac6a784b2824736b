// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace twocone::sim_povray {

/// Which files a scene may read, and where POV-Ray looks for those that it names. Nothing that stands in a scene adds
/// to what is readable.
class SceneAccess {
 public:
  /// @param scene_paths folders that are readable with all below them; empty: the scene's own
  SceneAccess(const std::filesystem::path& scene, const std::vector<std::filesystem::path>& scene_paths);

  /// Whether the file, its links followed, lies below a readable folder, POV-Ray's libraries or the system's fonts.
  [[nodiscard]] bool may_read(const std::filesystem::path& file) const;
  /// What is readable for the scene's sake: real, absolute paths.
  [[nodiscard]] const std::vector<std::filesystem::path>& readable() const { return readable_; }

  /// Where relative names are looked for, in POV-Ray's order: the scene's folder, POV-Ray's libraries, scene_paths, and
  /// what look_in() added.
  [[nodiscard]] const std::vector<std::filesystem::path>& searched() const { return searched_; }
  /// Also the folder of a file that the scene includes: a scene of others names what stands beside it. Passed over
  /// where it may not be read or is known.
  void look_in(const std::filesystem::path& folder);
  /// What of searched() POV-Ray has to be told of: without the scene's folder and the libraries.
  [[nodiscard]] std::vector<std::filesystem::path> told() const;

  /// The path of a file as a scene names it, readable or not; empty: there is none.
  [[nodiscard]] std::filesystem::path find(const std::string& name) const;

  /// What to add to a complaint of POV-Ray about a file that it cannot open: that a scene may not read or write it, and
  /// the line of the map that allows it. Empty if the complaint is about something else.
  [[nodiscard]] std::string advice(std::string_view complaint) const;
  /// Of a file that exists and may not be read.
  [[nodiscard]] static std::string refusal(const std::filesystem::path& file);

 private:
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> readable_;
  std::vector<std::filesystem::path> searched_;
  std::size_t libraries_ = 0;  ///< of searched_, after the scene's folder
};

/// POV-Ray's system-wide settings file; empty: none is found.
std::string system_ini();
/// What the process itself needs, as files and folders: the program, the system's libraries and fonts, POV-Ray's
/// settings and libraries.
std::vector<std::string> needed_to_run(const std::string& program);

}  // namespace twocone::sim_povray

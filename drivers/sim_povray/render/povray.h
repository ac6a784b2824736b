// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/render/child_process.h"
#include "drivers/sim_povray/render/picture.h"
#include "drivers/sim_povray/render/povray_answer.h"
#include "drivers/sim_povray/render/started_child.h"
#include "hal/frame.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// The program `name` as an absolute path: a path if it has a slash, else looked up in PATH.
/// Errors: kUnavailable, with what to install.
Result<std::string> find_povray(const std::string& name);

/// POV-Ray as it is run for one scene file: set up once, then used from several threads.
class Povray {
 public:
  /// @param program as find_povray() returns it
  /// @param scene_path the scene file: relative files of the scene are looked for in its folder, and messages name it
  /// as given here
  /// @param timeout for one picture
  Povray(std::string program, const std::filesystem::path& scene_path, std::chrono::nanoseconds timeout);

  /// Runs the program once; the calling thread must live until it returns. Errors: kTimeout (killed), kDisconnected (it
  /// crashed, or `stop_fd` got readable), kRefused (it says no: file and line), kBadData (no whole picture),
  /// kUnavailable (it could not be started).
  [[nodiscard]] ImageResult render(const RenderJob& job, int stop_fd) const;

  /// A picture to measure by: `scene`, which has no poses, without anti-aliasing. Errors: as render().
  [[nodiscard]] Result<DeepImage> render_deep(const std::string& label, const std::string& scene, int width_px,
                                              int height_px) const;

  [[nodiscard]] const std::string& scene_path() const { return scene_path_; }
  [[nodiscard]] std::chrono::nanoseconds timeout() const { return timeout_; }
  /// What to start for such pictures; the scene (kSceneFile) and where the picture goes (+O) are yet to be added.
  [[nodiscard]] Program program(const Mould& mould) const;

 private:
  /// Runs the program with `arguments` to a good end, in which it writes at most `most` bytes. Errors: as render().
  [[nodiscard]] Result<ChildResult> run(const RenderJob& job, std::vector<std::string> arguments, std::size_t most,
                                        int stop_fd) const;

  std::string program_;
  std::string scene_path_;
  std::string folder_;
  std::chrono::nanoseconds timeout_;
  std::vector<std::string> environment_;
};

/// The name under which POV-Ray finds its first input: the scene.
inline constexpr std::string_view kSceneFile = "/proc/self/fd/3";

/// POV-Ray's options for such pictures, without +O.
std::vector<std::string> povray_arguments(const Mould& mould);

/// A picture of a scene that has no poses: all of it.
RenderJob plain_picture(std::string label, std::string scene, int width_px, int height_px, int antialias);

/// The scene with `text` where the poses go.
std::string with_pose(const Mould& mould, std::string_view text);

/// Most that such a picture can take as a PPM.
std::size_t most_ppm_bytes(const Mould& mould);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim_povray/render/child_process.h"
#include "drivers/sim_povray/render/picture.h"
#include "drivers/sim_povray/render/povray_answer.h"
#include "drivers/sim_povray/render/scene_access.h"
#include "drivers/sim_povray/render/started_child.h"
#include "hal/frame.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// The program `name` as an absolute path: a path if it has a slash, else looked up in PATH.
/// Errors: kUnavailable, with what to install.
Result<std::string> find_povray(const std::string& name);

/// What a process of POV-Ray may do with files.
struct SceneLimits {
  std::shared_ptr<const Confinement> confinement{};  ///< none: what this program may
  std::shared_ptr<const SceneAccess> access{};       ///< where files are looked for; none: the scene's folder
};

/// POV-Ray as it is run for one scene file: set up once, then used from several threads.
class Povray {
 public:
  /// @param program as find_povray() returns it
  /// @param scene_path the scene file: relative files of the scene are looked for in its folder, and messages name it
  /// as given here
  /// @param timeout for one picture
  /// @param limits those of confined_povray(), which makes every Povray outside of tests
  Povray(std::string program, const std::filesystem::path& scene_path, std::chrono::nanoseconds timeout,
         SceneLimits limits = {});

  /// Runs the program once; the calling thread must live until it returns. Errors: kTimeout (killed), kDisconnected (it
  /// crashed, or `stop_fd` got readable), kRefused (it says no: file and line), kBadData (no whole picture),
  /// kUnavailable (it could not be started).
  [[nodiscard]] ImageResult render(const RenderJob& job, int stop_fd) const;

  /// A picture to measure by: `scene`, which has no poses, without anti-aliasing. Errors: as render().
  [[nodiscard]] Result<DeepImage> render_deep(const std::string& label, const std::string& scene, int width_px,
                                              int height_px) const;

  /// Of a process that ended without a picture: exit_error(), and what to do about a file that it could not open.
  [[nodiscard]] Error bad_end(const std::string& label, int wait_status, const std::string& errors) const;
  /// Why its processes cannot be held between pictures; empty: they can.
  [[nodiscard]] std::string hold_obstacle() const;

  /// Runs a scene that ends itself by `#error concat(kPovrayAnswer, ...)`, and returns what follows there.
  /// Errors: as render().
  [[nodiscard]] Result<std::string> ask(const std::string& label, std::string scene, int stop_fd) const;

  [[nodiscard]] const std::string& scene_path() const { return scene_path_; }
  [[nodiscard]] std::chrono::nanoseconds timeout() const { return timeout_; }
  /// What to start for such pictures; the scene (kSceneFile) and where the picture goes (+O) are yet to be added.
  [[nodiscard]] Program program(const Mould& mould) const;

 private:
  struct RunKind {
    bool is_deep = false;      ///< 16 bits a channel, linear light
    bool is_question = false;  ///< it ends with an error, which is what is wanted
  };
  /// Runs the program to a good end, in which it writes at most `most` bytes. Errors: as render().
  [[nodiscard]] Result<ChildResult> run(const RenderJob& job, const RunKind& kind, std::size_t most, int stop_fd) const;

  std::string program_;
  std::string scene_path_;
  std::string folder_;
  std::chrono::nanoseconds timeout_;
  std::vector<std::string> environment_;
  SceneLimits limits_;
};

/// What a scene begins its answer with that was asked something.
inline constexpr const char* kPovrayAnswer = "twocone answer: ";

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

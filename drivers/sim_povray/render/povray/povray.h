// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/child_process.h"
#include "drivers/sim_povray/render/povray/scene_access.h"
#include "drivers/sim_povray/render/renderer.h"
#include "hal/image.h"
#include "hal/result.h"

namespace twocone::sim_povray {

struct PlaceSettings;
struct SceneCalls;
class Scene;

/// Returns the program `name` as an absolute path: `name` itself if it has a slash, else the one found in PATH.
/// Errors: kUnavailable, with what to install.
Result<std::string> find_povray(const std::string& name);

/// Access of a POV-Ray process to files.
struct SceneLimits {
  std::shared_ptr<const base::Confinement> confinement{};  ///< none: the access of this program
  std::shared_ptr<const SceneAccess> access{};             ///< where files are searched for; none: the scene's folder
};

/// An image for measurements: linear light, 16 bits per channel, red, green and blue in turn, rows from the top.
struct DeepImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint16_t> levels;  ///< width_px * height_px * 3; 65535 is 1
};

/// Runs POV-Ray for one scene file: set up once, then used from several threads.
class Povray {
 public:
  /// @param program as find_povray() returns it
  /// @param scene_path the scene file: relative files of the scene are searched for in its folder, and messages name it
  /// as given here
  /// @param timeout for one image
  /// @param limits those of confined_povray(), which makes every Povray outside of tests
  Povray(std::string program, const std::filesystem::path& scene_path, std::chrono::nanoseconds timeout,
         SceneLimits limits = {});

  /// Runs the program once; the calling thread must live until it returns. Errors: kTimeout (killed), kDisconnected (it
  /// crashed, or `stop_fd` became readable), kRefused (POV-Ray reports an error: file and line), kBadData (no whole
  /// image), kUnavailable (it could not be started).
  [[nodiscard]] ImageResult render(const RenderJob& job, int stop_fd) const;

  /// Renders an image for measurements: `scene`, which has no poses, without anti-aliasing. Errors: as render().
  [[nodiscard]] Result<DeepImage> render_deep(const std::string& label, const std::string& scene, int width_px,
                                              int height_px) const;

  /// Returns the error of a process that ended without an image: exit_error(), with advice about a file that it could
  /// not open.
  [[nodiscard]] Error bad_end(const std::string& label, int wait_status, const std::string& errors) const;
  /// Returns why its processes cannot be held between images; empty: they can.
  [[nodiscard]] std::string hold_obstacle() const;

  /// Runs a scene that ends itself by `#error concat(kPovrayAnswer, ...)`, and returns the text that follows it.
  /// Errors: as render().
  [[nodiscard]] Result<std::string> ask(const std::string& label, std::string scene, int stop_fd) const;

  [[nodiscard]] const std::string& program_path() const { return program_; }
  [[nodiscard]] std::chrono::nanoseconds timeout() const { return timeout_; }
  /// Returns the program to start for such images; the caller must add the scene (kSceneFile) and the file of the image
  /// (+O).
  [[nodiscard]] base::Program program(const ViewTemplate& view_template) const;

 private:
  struct RunKind {
    bool is_deep = false;      ///< 16 bits a channel, linear light
    bool is_question = false;  ///< it ends with an error on purpose
  };
  /// Runs the program until it succeeds; it may write at most `most` bytes. Errors: as render().
  [[nodiscard]] Result<base::ChildResult> run(const RenderJob& job, const RunKind& kind, std::size_t most,
                                              int stop_fd) const;

  std::string program_;
  std::string scene_path_;
  std::string folder_;
  std::chrono::nanoseconds timeout_;
  std::vector<std::string> environment_;
  SceneLimits limits_;
};

/// Returns POV-Ray, confined to what the scene of `place` may read (SceneAccess), with `calls` or as find_calls()
/// returns them for `scene`. A scene may come from other people: this is the one place where its limits are set.
/// Errors: kUnavailable (no POV-Ray); kNotFound (a folder of scene_paths does not exist); kRefused, if the kernel
/// cannot confine reading: the scene names a file outside, with file and line.
[[nodiscard]] Result<Povray> confined_povray(const PlaceSettings& place, const SceneCalls& calls);
[[nodiscard]] Result<Povray> confined_povray(const PlaceSettings& place, const Scene& scene);

/// Beginning of the answer of a scene that Povray::ask() runs.
inline constexpr const char* kPovrayAnswer = "twocone answer: ";

/// The name under which POV-Ray finds its first input: the scene.
inline constexpr std::string_view kSceneFile = "/proc/self/fd/3";

/// Returns POV-Ray's options for such images, without +O.
std::vector<std::string> povray_arguments(const ViewTemplate& view_template);

/// Returns the job for a whole image of a scene that has no poses.
RenderJob plain_image(std::string label, std::string scene, int width_px, int height_px, int antialias);

/// Returns the scene with `text` where the poses go.
std::string with_pose(const ViewTemplate& view_template, std::string_view text);

/// Returns the largest size of such an image as a PPM.
std::size_t most_ppm_bytes(const ViewTemplate& view_template);

// ---- reading what POV-Ray answers, and the error if there is no image (povray_answer.cpp)

/// Parses a binary PPM with 8 bits per channel, and nothing after it, as kRgb8. Errors: kBadData.
Result<Image> parse_ppm(std::string_view bytes);
/// Parses a binary PPM with 16 bits per channel, big-endian as POV-Ray writes them. Errors: kBadData.
Result<DeepImage> parse_deep_ppm(std::string_view bytes);

/// Returns the job's image. Errors: kBadData (no whole image, or one of another size).
ImageResult image_from(std::string_view ppm, const RenderJob& job);
Result<DeepImage> deep_image_from(std::string_view ppm, const RenderJob& job);

/// Returns the message in POV-Ray's standard error that states why it stopped, with lines that it folded at 80 columns
/// unfolded, as `FILE:LINE: POV-Ray: TEXT`; without a position it is `SCENE: POV-Ray: TEXT`. Empty if there is none.
/// @param scene_path replaces the name under which POV-Ray was given the scene
std::string povray_complaint(const std::string& errors, const std::string& scene_path);

/// Returns the message about a file that is not found: `Cannot find file 'F', ...`; empty if there is none.
std::string missing_file(const std::string& errors);

/// Returns the error of a process that ended without an image: kDisconnected (it crashed), kRefused (POV-Ray reports an
/// error: file and line).
/// @param wait_status as waitpid() returns it
Error exit_error(const std::string& label, int wait_status, const std::string& errors, const std::string& scene_path);
Error timeout_error(const std::string& label, std::chrono::nanoseconds timeout);
/// @param what the state that POV-Ray had not reached: "started", "finished"
Error closed_error(const std::string& label, const char* what);

}  // namespace twocone::sim_povray

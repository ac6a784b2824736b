// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "hal/frame.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// One picture to make.
struct RenderJob {
  std::string label;  ///< for messages: "frame 12, view lower"
  std::string scene;  ///< the scene's text
  int width_px = 0;
  int height_px = 0;
  int antialias = 1;  ///< rays per pixel side
};

/// The program `name` as an absolute path: a path if it has a slash, else looked up in PATH.
/// Errors: kUnavailable, with what to install.
Result<std::string> find_povray(const std::string& name);

/// POV-Ray as it is run for one scene file: set up once, then used from several threads.
class Povray {
 public:
  /// @param program as find_povray() returns it
  /// @param scene_path the scene file: relative files of the scene are looked for in its folder, and messages name it
  /// as
  ///        given here
  Povray(std::string program, const std::filesystem::path& scene_path, std::chrono::nanoseconds timeout);

  /// Runs the program once; the calling thread must live until it returns. Errors: kTimeout (killed), kDisconnected (it
  /// crashed, or `stop_fd` got readable), kRefused (it says no: file and line), kBadData (no whole picture),
  /// kUnavailable (it could not be started).
  [[nodiscard]] ImageResult render(const RenderJob& job, int stop_fd) const;

 private:
  std::string program_;
  std::string scene_path_;
  std::string folder_;
  std::chrono::nanoseconds timeout_;
  std::vector<std::string> environment_;
};

/// POV-Ray's options for `job`.
std::vector<std::string> povray_arguments(const RenderJob& job);

/// A binary PPM with 8 bits a channel, and nothing after it, as kRgb8. Errors: kBadData.
Result<Image> parse_ppm(std::string_view bytes);

/// The one message in POV-Ray's standard error that says why it gave up, with lines that it folded at 80 columns
/// unfolded, as `FILE:LINE: POV-Ray: TEXT`; without a place it is `SCENE: POV-Ray: TEXT`. Empty if there is none.
/// @param scene_path put in place of the name under which POV-Ray was given the scene
std::string povray_complaint(std::string_view errors, const std::string& scene_path);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace twocone::sim_povray {

/// Greatest width and height of an image. Its size in bytes does not overflow.
constexpr int kMaxSide_px = 16384;

/// How images are rendered. The defaults suit two cores.
struct RenderSettings {
  std::string povray = "povray";  ///< the program: a path, or a name looked up in PATH
  int processes = 8;              ///< POV-Ray processes at one time, >= 1; more than cores, as each sleeps at times
  bool hold = true;               ///< keep processes between images; off: one process per image
  bool whole_image = false;       ///< also render the pixels outside the mirror
  bool landlock = true;           ///< confine POV-Ray by Landlock if the kernel has it; off: as on a kernel without
  std::chrono::milliseconds timeout{120'000};  ///< time limit of one image, > 0; then the process is killed
  /// Called from any thread with a line for a person: rendering fell back to a slower method, and why.
  std::function<void(const std::string&)> notice{};
};

/// @throws std::invalid_argument naming every bad field
void check(const RenderSettings& settings);

}  // namespace twocone::sim_povray

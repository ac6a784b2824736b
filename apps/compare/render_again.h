// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>

#include "apps/runlog/run_data.h"
#include "drivers/sim_povray/render_settings.h"
#include "hal/result.h"

namespace twocone::compare {

struct RenderAgain {
  std::filesystem::path real;   ///< run folder
  std::filesystem::path scene;  ///< map with a scene
  std::filesystem::path poses;  ///< given trajectory, TUM; empty: the run's own estimate, as in compare()
  std::filesystem::path to;     ///< run folder to write, or one that was begun before
  int fit_frames = 150;         ///< frames of the calibration that determines the poses
  sim_povray::RenderSettings render{};
  std::function<void(double)> progress;  ///< fraction done. May be empty
  const std::atomic<bool>* stop = nullptr;
};

/// Renders the real run's frames as an ideal camera in the scene shows them from the real robot's poses. The result is
/// a run folder with method outline's answers. Its truth is those poses, and its wheels turned exactly as those poses
/// require. Frames with an unknown pose are left out. Existing images are not rendered again, unless the map, a .pov or
/// .inc file in the scene's folder, the cameras or the poses have changed since.
///
/// The scene must show the robot at the run's `start:` (at the world's origin where it has none), with cameras named
/// lower and upper. The images have the size of the real ones and no effects.
/// Errors: kBadData (no frame with a pose), those of rendering. @throws config::FileError, runlog::DiskError
Status render_again(const RenderAgain& settings);

}  // namespace twocone::compare

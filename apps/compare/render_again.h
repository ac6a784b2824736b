// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>

#include "apps/runs/run_data.h"
#include "drivers/sim_povray/sim_povray.h"
#include "hal/result.h"

namespace twocone::compare {

struct RenderAgain {
  std::filesystem::path real;   ///< run folder
  std::filesystem::path scene;  ///< map with a scene
  std::filesystem::path poses;  ///< given trajectory, TUM; empty: the run's own estimate, as compare() makes it
  std::filesystem::path to;     ///< run folder to be made, or one that was begun before
  int fit_frames = 150;         ///< of the calibration from which the poses come
  sim_povray::RenderSettings render{};
  std::function<void(double)> progress;  ///< fraction done. May be empty
  const std::atomic<bool>* stop = nullptr;
};

/// The real run's frames as an ideal camera in the scene shows them from where the real robot was: a run folder with
/// method full's answers, whose truth is those poses, and whose wheels turned exactly as those poses ask for. Frames
/// whose pose is not known are left out. Pictures that are there already are not rendered again, unless the map, a .pov
/// or .inc file in the scene's folder, the cameras or the places have changed since.
///
/// The scene must show the robot standing at the run's `start:` (the world's origin where it has none), with cameras of
/// the names lower and upper; pictures get the real ones' size, no effects.
/// Errors: kBadData (no frame with a pose), those of rendering. @throws files::FileError, runs::DiskError
Status render_again(const RenderAgain& settings);

}  // namespace twocone::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "apps/calibrate/calibrate.h"
#include "apps/compare/both_runs.h"
#include "apps/compare/comparison.h"
#include "apps/compare/findings.h"
#include "hal/result.h"

namespace twocone::compare {

struct Settings {
  std::filesystem::path simulated, real;  ///< run folders
  std::filesystem::path real_poses;       ///< given trajectory of the real run, TUM; empty: none
  std::filesystem::path work;             ///< folder of finished parts; the same command continues from them
  bool is_rendered = false;               ///< `simulated` was made by render_again()
  int fit_frames = 150;                   ///< frames that each calibration uses, >= 4
  int every = 1;                          ///< the images of every such real frame are measured, >= 1
  int jobs = 2;                           ///< threads, >= 1
  double false_alarm = 1e-3;              ///< probability for the whole comparison, in (0, 1)
  Limits limits;
  std::function<void(double)> progress = [](double) {};  ///< called with the fraction done, in [0, 1]
  const std::atomic<bool>* stop = nullptr;
};

/// The results of a comparison, with the data that correct robot files.
struct Outcome {
  Comparison comparison;
  Images images;
  std::optional<calibrate::Report> calibration;  ///< of the real run
};

/// Compares two runs of one robot. Where both were run among the same landmarks, images are compared too.
/// Errors: kBadData (the runs cannot be compared, one line), kCancelled (stopped). @throws config::FileError,
/// runlog::DiskError, std::invalid_argument for settings
Result<Outcome> compare(const Settings& settings);

/// Returns the differences, the gaps and the stages as text for a terminal; at most 100 columns.
std::string table(const Comparison& comparison);
/// Returns compare.json: all results, in the units that each number names.
std::string to_json(const Comparison& comparison);

/// Renders the real run's frames as an ideal camera in the scene shows them from the real robot's poses. Without given
/// poses, these are the run's own estimate, as in compare(). The result is a run folder with method outline's answers,
/// Settings::simulated, which may be one that was begun before. Its truth is those poses, and its wheels turned exactly
/// as those poses require. Frames with an unknown pose are left out. Existing images are not rendered again, unless the
/// map, a .pov or .inc file in the scene's folder, the cameras or the poses have changed since.
///
/// The scene must show the robot at the run's `start:` (at the world's origin where it has none), with cameras named
/// lower and upper. The images have the size of the real ones and no effects.
/// @param scene map with a scene
/// Errors: kBadData (no frame with a pose), those of rendering. @throws config::FileError, runlog::DiskError
Status render_again(const Settings& settings, const std::filesystem::path& scene);

/// Returns the real run's robot file with the rig and the wheels that its calibration found. It contains all numbers of
/// the calibration, because they belong together, and not only those that differ. @throws config::FileError as
/// config::robot_text
std::string corrected_robot(const Outcome& outcome, const std::filesystem::path& new_file);

/// Returns the simulated run's robot file, changed so that its next run behaves like the real one. It keeps its own
/// `rig:`, which is that of its scene. For the sources that differ it contains: the mean gain of the colours, noise,
/// blur, rolling shutter, skew, latency and lost frames as effects of the cameras, the frame rate, wheels and slip. The
/// exposure of a real camera cannot be distinguished from its gain. @throws config::FileError as config::robot_text
std::string like_the_real(const Outcome& outcome, const std::filesystem::path& new_file);

/// Writes FOLDER/compare.html, one page that needs no other file and no network, and its figures into FOLDER/figures.
/// The page begins with the verdict and the sources. Gaps before and after, the stages with their lights, frames side
/// by side and blended with a slider, unwrapped mirrors with their difference, residuals, and both paths over the arena
/// from above follow. A figure or image that cannot be made is left out, and the page states why. The page is UTF-8 and
/// well-formed XML; equal content gives equal bytes.
/// Errors: kUnavailable (no gnuplot, a file that cannot be written)
Status write_page(const Comparison& comparison, const std::filesystem::path& folder);

}  // namespace twocone::compare

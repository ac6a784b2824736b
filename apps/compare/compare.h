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
  std::filesystem::path real_poses;       ///< file of a given trajectory of the real run (TUM format); empty: none
  std::filesystem::path work;             ///< folder of finished parts; the same command continues from them
  bool is_rendered = false;               ///< whether render_again() made `simulated`
  int fit_frames = 150;                   ///< number of frames that each calibration uses, >= 4
  int every = 1;                          ///< step between the real frames whose images are measured, >= 1
  int jobs = 2;                           ///< number of threads, >= 1
  double false_alarm = 1e-3;              ///< probability of a false alarm in the whole comparison, in (0, 1)
  Limits limits;
  std::function<void(double)> progress = [](double) {};  ///< called with the fraction done, in [0, 1]
  const std::atomic<bool>* stop = nullptr;
};

/// The results of a comparison, and the data from which corrected robot files are made.
struct Outcome {
  Comparison comparison;
  Images images;
  std::optional<calibrate::Report> calibration;  ///< of the real run
};

/// Compares two runs of one robot in one room (why_other_rooms). The colours of images are compared only if both runs'
/// images have the same size.
/// Errors: kBadData (the runs cannot be compared, one line), kCancelled (stopped). @throws config::FileError,
/// runlog::DiskError, std::invalid_argument for settings outside their domain
Result<Outcome> compare(const Settings& settings);

/// Returns the differences, the gaps and the stages as text for a terminal; at most 100 columns.
std::string table(const Comparison& comparison);
/// Returns compare.json: all results, with their units (docs/file-formats.md).
std::string to_json(const Comparison& comparison);

/// Renders the real run's frames as an ideal camera in the scene shows them from the real robot's poses. Without given
/// poses, these are the run's own estimate, even if the run has ground truth. The result is the run folder
/// Settings::simulated with the answers of method outline; an unfinished one is continued. Its truth is those poses,
/// and its wheels turn exactly as those poses require. Frames with an unknown pose are left out. Existing images are
/// rendered again only if the map, a .pov or .inc file in the scene's folder, the cameras or the poses have changed.
///
/// The scene must show the robot at `start:` of its robot file (without `start:`, at the world's origin), with cameras
/// named lower and upper. The images have the size of the real ones and no effects.
/// @param scene map that names a scene
/// Errors: kBadData (the run cannot be compared, it is of another room, or no frame has a pose), kCancelled (stopped),
/// those of rendering. @throws config::FileError, runlog::DiskError
Status render_again(const Settings& settings, const std::filesystem::path& scene);

/// Returns the real run's robot file with the rig and the wheels that its calibration found. It contains all numbers of
/// the calibration, not only those that differ, because they belong together. Requires Outcome::calibration.
/// It names config::calibration_file_of(new_file), which holds calibrate::to_json of Outcome::calibration.
/// @throws config::FileError as config::robot_text
std::string corrected_robot(const Outcome& outcome, const std::filesystem::path& new_file);

/// Returns the simulated run's robot file, changed so that its next run behaves like the real one. It keeps its own
/// `rig:`, which is that of its scene. For the sources that differ it contains the frame rate, the wheels, slip, and as
/// effects of the cameras: mean gain of the colours, vignetting, noise, blur, rolling shutter, skew, latency and lost
/// frames. The exposure of a real camera cannot be distinguished from its gain.
/// @throws config::FileError as config::robot_text
std::string like_the_real(const Outcome& outcome, const std::filesystem::path& new_file);

/// Returns compare.html, the viewer with compare.json and the images: the verdict and the sources, the gaps before and
/// after, the stages with their lights, frames side by side and blended with a slider, unwrapped mirrors with their
/// difference, residuals, and both paths over the arena from above. An image that cannot be made is left out, and the
/// page states why. Equal content gives equal bytes.
/// @param folder of the comparison; keeps the image of the arena, figures/overhead.png, for the next time
std::string page(const Comparison& comparison, const std::filesystem::path& folder);

}  // namespace twocone::compare

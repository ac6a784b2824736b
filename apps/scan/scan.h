// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>

#include "hal/result.h"
#include "vision/scan.h"

/// Range to everything from the images of a stored run.
namespace twocone::scan {

struct ScanOptions {
  vision::ScanSettings settings{};
  int every = 1;                                ///< uses every such frame, >= 1
  bool clouds = false;                          ///< also writes clouds/FRAME.ply
  bool plan = false;                            ///< also writes plan.csv: the pose by the map's walls and obstacles
  std::function<void(double done)> progress{};  ///< receives the fraction that is done; may be empty
  const std::atomic<bool>* stop = nullptr;      ///< set from outside: the work ends, and nothing is changed
};

struct ScanCounts {
  int frames = 0;
  int without_images = 0;  ///< frames that were left out
  int clouds = 0;
  long unknown = 0, free = 0, occupied = 0;  ///< beams
  long points = 0;                           ///< ranges in all range images
  int placed = 0;                            ///< frames with a pose by the plan
  /// Of those, where the run has the truth: mean error of the position and of the heading, and the shares of poses
  /// whose 95 % ellipse, and 1.96 sigma of the heading, hold it.
  std::optional<double> position_error_m{}, heading_error_rad{}, position_held{}, heading_held{};
};

/// Returns the file with the poses by the floor plan.
std::filesystem::path plan_file(const std::filesystem::path& run);
/// Returns the file with the scans of a run.
std::filesystem::path scan_file(const std::filesystem::path& run);

/// Ranges everything that the pairs of images of a run show (vision::DenseRanging with the run's believed rig), and
/// writes scan.csv into its folder, with clouds/FRAME.ply if they are wanted, in the place of earlier ones.
///
/// scan.csv has a row for each beam: frame, t_s, beam_rad (body frame, the middle of the beam), state (unknown, free,
/// occupied), range_m, sigma_m; the last two are empty where there is none. A cloud has x, y, z in metres and the
/// standard deviation of the range, as floats. It is in the world's frame by the run's estimate, or in the body's frame
/// where the estimate has no pose for the frame; a comment in it says which.
///
/// plan.csv has a row for each frame that was placed: frame, t_s, x_m, y_m, heading_rad, the covariance of the three,
/// and the number of beams on the plan with their distance from it. The landmarks are not used. The search starts at
/// the start of the robot file, 0.3 m and 10 degrees around it, and goes on from the last pose by the wheels.
/// @returns Errors: kNotFound, kBadData: no frame has both its images; kCancelled
/// @throws config::FileError for a folder that is no run, or a rig that vision rejects; std::invalid_argument for
/// options outside their domain; runlog::DiskError
Result<ScanCounts> scan(const std::filesystem::path& run, const ScanOptions& options);

}  // namespace twocone::scan

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/calibrate/calibrate.h"
#include "apps/compare/comparison.h"
#include "apps/runlog/run_data.h"
#include "hal/result.h"
#include "localisation/fix.h"
#include "localisation/odometry.h"
#include "vision/calibration.h"
#include "vision/mirror_view.h"
#include "vision/ranging.h"

/// What is measured in one run alone.
namespace twocone::compare {

/// One of the two runs, with the measurements of its robot from its own data. Ground truth enters only `reference`.
struct Side {
  std::string name;     ///< the folder, as the command named it
  runlog::RunData run;  ///< frames, wheels and poses; ranges and sightings are read where they are needed
  std::string method;   ///< method of the ranges and fixes that are compared; empty: those in the run folder itself
  /// None where the drive does not determine it; then `why_no_calibration` states the reason.
  std::optional<calibrate::Report> calibration{};
  std::string why_no_calibration{};
  int chosen = 0;  ///< frames chosen for the calibration
  /// Shifts of landmarks against the others, by name, for the landmarks in the calibration's frames.
  std::map<std::string, vision::RelativeShift> map_shifts{};
  std::vector<std::string> left_out{};  ///< data of the run that are not used, a sentence each
  vision::Rig believed;                 ///< `rig:`
  vision::Rig found;                    ///< rig of the calibration; without one, the believed rig
  /// Pose of the robot at each frame.
  std::vector<std::optional<runlog::PoseRow>> reference{};
  std::string reference_is{};       ///< truth, given trajectory, estimate
  bool is_reference_apart = false;  ///< the reference does not come from the run's own images
};

inline constexpr double kDegree = std::numbers::pi / 180;

/// Reads a run. @param poses given trajectory (TUM, the run's clock); empty: none
/// Errors: kBadData (the run cannot be compared, one line). @throws config::FileError as read_run
Result<Side> read_side(const std::filesystem::path& folder, const std::filesystem::path& poses);

/// Calibrates the rig from the run's own data, with timing and the landmarks' places among the unknowns.
/// @param frames that the calibration uses. @param progress fraction done. May be empty
void calibrate_side(Side& side, int frames, const std::function<void(double)>& progress);

/// Sums of numbers, for mean and root mean square.
struct Moments {
  std::size_t count = 0;
  double sum = 0, squares = 0;

  void add(double value) {
    ++count;
    sum += value;
    squares += value * value;
  }
  [[nodiscard]] std::optional<double> mean() const { return count ? std::optional(sum / double(count)) : std::nullopt; }
  [[nodiscard]] std::optional<double> rms() const {
    return count ? std::optional(std::sqrt(squares / double(count))) : std::nullopt;
  }
};

/// Differences of a run's answers from its reference, over all its frames.
struct Residuals {
  Moments range_m, bearing_rad, disparity_px;  ///< measured minus the value at the reference pose, as the run had it
  Moments fix_m;                               ///< distance of fix and reference; none without an independent reference
  std::size_t frames = 0, with_fix = 0;
  std::size_t looked_for = 0, ranged = 0, outliers = 0;  ///< landmarks times frames
  std::vector<bool> has_range;                           ///< in the order of the frames, for each landmark of the map
  std::vector<ResidualPoint> points;                     ///< thinned out evenly to at most kMostPoints
  static constexpr std::size_t kMostPoints = 3000;
};

/// Sets the references of a side without a given trajectory or truth: fixes from its sightings under Side::found.
/// @throws config::FileError as TableReader
void locate(Side& side);

/// @throws config::FileError as TableReader
Residuals residuals_of(const Side& side);

/// Returns a point of the world in the body's frame.
Eigen::Vector2d in_body(const runlog::PoseRow& pose, const Eigen::Vector2d& place_m);

localisation::Pose pose_of(const runlog::PoseRow& row);

/// Returns the pose of a fix, if it can be trusted.
std::optional<runlog::PoseRow> pose_of(const localisation::Fix& fix, double t_s);

/// Returns the measurement from two sightings of a landmark under `rig`; nothing: that view has none.
vision::RangeMeasurement range_under(const vision::Rig& rig, const std::optional<vision::Sighting>& lower,
                                     const std::optional<vision::Sighting>& upper, const Landmark& target);

}  // namespace twocone::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "apps/compare/comparison.h"
#include "apps/compare/side.h"
#include "apps/estimation/estimator.h"
#include "apps/runlog/answer_rows.h"
#include "localisation/odometry.h"
#include "vision/ranging.h"

namespace twocone::compare {

/// Sums of numbers, for mean and root mean square.
struct Moments {
  std::size_t count = 0;
  double sum = 0, squares = 0;

  void add(double value);
  [[nodiscard]] std::optional<double> mean() const;
  [[nodiscard]] std::optional<double> rms() const;
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

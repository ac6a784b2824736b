// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "apps/compare/comparison.h"
#include "apps/compare/side.h"
#include "apps/runs/estimator.h"
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

/// What a run's answers are against its reference, over all its frames.
struct Residuals {
  Moments range_m, bearing_rad, disparity_px;  ///< measured less that of the reference pose, as the run had it
  Moments fix_m;                               ///< distance of fix and reference; none where that is not apart
  std::size_t frames = 0, with_fix = 0;
  std::size_t looked_for = 0, ranged = 0, outliers = 0;  ///< landmarks times frames
  std::vector<bool> has_range;                           ///< frame after frame, for each landmark of the map
  std::vector<ResidualPoint> points;                     ///< thinned out evenly to kMostPoints or fewer
  static constexpr std::size_t kMostPoints = 3000;
};

/// Fills the references of a side without a given trajectory or truth: fixes from its sightings under Side::found.
/// @throws files::FileError as TableReader
void locate(Side& side);

/// @throws files::FileError as TableReader
Residuals residuals_of(const Side& side);

/// Where a place of the world is in the body's frame.
Eigen::Vector2d in_body(const runs::PoseRow& pose, const Eigen::Vector2d& place_m);

/// The pose that a fix tells, if it is one that can be trusted.
std::optional<runs::PoseRow> pose_of(const localisation::Fix& fix, double t_s);

/// What two sightings of a landmark tell under `rig`; null where a view has none.
vision::RangeMeasurement range_under(const vision::Rig& rig, const vision::Sighting* lower,
                                     const vision::Sighting* upper, const vision::Target& target);

/// What each landmark's sightings of a frame tell under `rig`, in the map's order; with verdict kNotSeen where there
/// are none.
std::vector<vision::RangeMeasurement> ranges_under(const vision::Rig& rig, const files::Map& map,
                                                   const runs::AnswerRows& rows);

}  // namespace twocone::compare

// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/side.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Dense>

#include "apps/config/to_layers.h"
#include "apps/estimation/adaptive.h"
#include "apps/runlog/tables/answer_reader.h"
#include "localisation/odometry.h"
#include "vision/calibration.h"
#include "vision/triangulation.h"

namespace twocone::compare {
namespace {

using runlog::PoseRow;

/// The range and the sightings of a landmark in one frame.
struct Seen {
  const runlog::RangeRow* range = nullptr;
  std::optional<vision::Sighting> lower, upper;
};

std::vector<Seen> by_landmark(const config::Map& map, const runlog::AnswerRows& rows) {
  std::vector<Seen> seen(map.landmarks.size());
  const auto find = [&](const std::string& name) {
    const auto at = std::ranges::find(map.landmarks, name, &config::Landmark::name);
    return at == map.landmarks.end() ? nullptr : &seen[std::size_t(at - map.landmarks.begin())];  // null: another map's
  };
  for (const runlog::RangeRow& row : rows.ranges) {
    if (Seen* const s = find(row.landmark)) s->range = &row;
  }
  for (const runlog::SightingRow& row : rows.sightings) {
    Seen* const s = find(row.landmark);
    if (!s) continue;
    vision::Sighting sighting;
    sighting.pixel_px = {row.column_px, row.row_px};
    sighting.covariance_px2 << row.var_column_px2, row.cov_px2, row.cov_px2, row.var_row_px2;
    if (sighting.covariance_px2.llt().info() != Eigen::Success) continue;
    (row.view == to_string(vision::Side::kLower) ? s->lower : s->upper) = sighting;
  }
  return seen;
}

/// Returns whether the landmark itself was sighted. Ranges may fail under a wrong rig; sightings do not.
bool is_trusted(const runlog::RangeRow& row) {
  using vision::RangeVerdict;
  constexpr std::array kTrusted{RangeVerdict::kOk, RangeVerdict::kOneView, RangeVerdict::kInconsistent,
                                RangeVerdict::kBeyondLimit};
  return std::ranges::any_of(kTrusted, [&](RangeVerdict v) { return row.verdict == to_string(v); });
}

/// Returns the disparity of the landmark's top in the undistorted images, as defined in triangulate().
std::optional<double> disparity_at(const vision::Rig& rig, const Eigen::Vector2d& in_body_m, const Landmark& target) {
  const auto radius_px = [&](const vision::MirrorView& view) -> std::optional<double> {
    const auto point = vision::near_top_point(view, in_body_m, target.radius_m, target.top_m);
    const auto pixel = point ? view.project(*point) : std::nullopt;
    const auto undistorted = pixel ? view.undistort_px(*pixel) : std::nullopt;
    return undistorted ? std::optional((*undistorted - view.settings().centre_px).norm()) : std::nullopt;
  };
  const auto lower_px = radius_px(rig.lower), upper_px = radius_px(rig.upper);
  if (!lower_px || !upper_px) return std::nullopt;
  return *lower_px - *upper_px * rig.lower.focal_length_px() / rig.upper.focal_length_px();
}

/// Returns the measurement of each landmark from a frame's sightings under `rig`, in the map's order; with verdict
/// kNotSeen for a landmark without sightings.
std::vector<vision::RangeMeasurement> ranges_under(const vision::Rig& rig, const config::Map& map,
                                                   const runlog::AnswerRows& rows) {
  const auto targets = config::to_targets(map);
  const auto seen = by_landmark(map, rows);
  std::vector<vision::RangeMeasurement> ranges(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i].range || !is_trusted(*seen[i].range)) continue;
    ranges[i] = range_under(rig, seen[i].lower, seen[i].upper, targets[i]);
  }
  return ranges;
}

}  // namespace

Eigen::Vector2d in_body(const PoseRow& pose, const Eigen::Vector2d& place_m) {
  return Eigen::Rotation2Dd(-pose.heading_rad) * (place_m - Eigen::Vector2d(pose.x_m, pose.y_m));
}

localisation::Pose pose_of(const PoseRow& row) { return {row.x_m, row.y_m, row.heading_rad}; }

std::optional<PoseRow> pose_of(const localisation::Fix& fix, double t_s) {
  if (fix.verdict != localisation::FixVerdict::kOk || !fix.position_m || !fix.heading_rad) return std::nullopt;
  return PoseRow{t_s, fix.position_m->x(), fix.position_m->y(), *fix.heading_rad};
}

vision::RangeMeasurement range_under(const vision::Rig& rig, const std::optional<vision::Sighting>& lower,
                                     const std::optional<vision::Sighting>& upper, const Landmark& target) {
  const vision::Triangulation t =
      vision::triangulate(rig, lower ? &*lower : nullptr, upper ? &*upper : nullptr, target.radius_m, target.top_m);
  vision::RangeMeasurement m;
  m.verdict = t.verdict;
  m.range_m = t.range_m;
  m.bearing_rad = t.bearing_rad;
  m.covariance = t.covariance;
  m.disparity_px = t.disparity_px;
  return m;
}

void locate(Side& side) {
  if (side.is_reference_apart) return;
  side.reference_is = "estimate";
  side.reference.assign(side.run.frames.size(), std::nullopt);
  const auto landmarks_m = config::to_landmark_positions(side.run.map);
  runlog::AnswerReader reader(side.run.folder, side.method);
  for (std::size_t i = 0; i < side.run.frames.size(); ++i) {
    const runlog::FrameRow& frame = side.run.frames[i];
    const auto ranges = ranges_under(side.found, side.run.map, reader.of(frame.frame));
    side.reference[i] = pose_of(estimation::fix_of_outline(ranges, landmarks_m, true), frame.t_s);
  }
}

Residuals residuals_of(const Side& side) {
  Residuals all;
  const config::Map& map = side.run.map;
  const auto targets = config::to_targets(map);
  const auto landmarks_m = config::to_landmark_positions(map);
  const std::size_t count = map.landmarks.size();
  all.frames = side.run.frames.size();
  all.has_range.assign(all.frames * count, false);
  const std::size_t every = (all.frames * count + Residuals::kMostPoints - 1) / Residuals::kMostPoints;
  runlog::AnswerReader reader(side.run.folder, side.method);
  for (std::size_t i = 0; i < all.frames; ++i) {
    const runlog::FrameRow& frame = side.run.frames[i];
    const runlog::AnswerRows rows = reader.of(frame.frame);
    const auto& reference = side.reference[i];
    const auto after = ranges_under(side.found, map, rows);
    const auto seen = by_landmark(map, rows);
    for (std::size_t k = 0; k < count; ++k) {
      if (!seen[k].range) continue;
      const runlog::RangeRow& row = *seen[k].range;
      ++all.looked_for;
      if (!row.range_m) continue;
      ++all.ranged;
      all.has_range[i * count + k] = true;
      if (!reference) continue;
      const Eigen::Vector2d to_m = in_body(*reference, landmarks_m[k]);
      ResidualPoint point{frame.t_s, k, to_m.norm(), *row.range_m - to_m.norm(), std::nullopt};
      all.range_m.add(point.before_m);
      if (after[k].range_m) point.after_m = *after[k].range_m - to_m.norm();
      if (row.bearing_rad) {
        all.bearing_rad.add(localisation::wrap_angle_rad(*row.bearing_rad - std::atan2(to_m.y(), to_m.x())));
      }
      const auto disparity = row.disparity_px ? disparity_at(side.believed, to_m, targets[k]) : std::nullopt;
      if (disparity) all.disparity_px.add(*row.disparity_px - *disparity);
      if ((i * count + k) % every == 0) all.points.push_back(point);
    }
    if (rows.fixes.empty()) continue;
    const runlog::FixRow& fix = rows.fixes.front();
    all.outliers += fix.outliers.size();
    if (!fix.x_m || !fix.y_m || is_out_of_bounds(fix)) continue;
    ++all.with_fix;
    if (side.is_reference_apart && reference) {
      all.fix_m.add(std::hypot(*fix.x_m - reference->x_m, *fix.y_m - reference->y_m));
    }
  }
  return all;
}

}  // namespace twocone::compare

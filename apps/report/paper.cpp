// SPDX-License-Identifier: Apache-2.0
#include "apps/report/paper.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <boost/algorithm/string/predicate.hpp>

namespace twocone::report {
namespace {

/// Returns the range beyond which the lower mirror shows a point that is `above_tip_m` above its tip, metres.
double inside_rim_from_m(const config::Rig& rig, double above_tip_m) {
  const double d = rig.lower.lens_to_tip_m;
  const double R = rig.lower.mirror_radius_m;
  return above_tip_m * (d + R) / R - d;
}

}  // namespace

const paper::LandmarkFigures* paper::find_landmark(std::string_view name) {
  const auto* found = std::ranges::find_if(kLandmarks, [&](const auto& l) { return boost::iequals(l.name, name); });
  return found == kLandmarks.end() ? nullptr : found;
}

double range_per_pixel_m(const config::Rig& rig, double range_m) {
  const double d = rig.lower.lens_to_tip_m;
  const double v_px = (d / rig.lower.mirror_radius_m + 1) * rig.lower.rim_radius_px;
  return (range_m + d) * (range_m + d) / (v_px * rig.mirror_separation_m);
}

double nearest_common_m(const config::Rig& rig) { return inside_rim_from_m(rig, rig.mirror_separation_m); }

double nearest_top_m(const config::Rig& rig, double top_m) {
  return std::max(0.0, inside_rim_from_m(rig, top_m - rig.lens_height_m - rig.lower.lens_to_tip_m));
}

bool is_right_angled(const config::Rig& rig) {
  constexpr double kSame_rad = 1e-6;  // rounding of a decimal number in a file
  return std::abs(rig.lower.apex_rad - std::numbers::pi / 2) < kSame_rad &&
         std::abs(rig.upper.apex_rad - std::numbers::pi / 2) < kSame_rad;
}

std::optional<double> rounding_error_m(const runlog::RunData& run, const config::Landmark& landmark) {
  if (!is_right_angled(run.robot.rig)) return std::nullopt;
  double sum_m = 0;
  int count = 0;
  for (const runlog::RangeRow& row : run.ranges) {
    if (row.landmark != landmark.name || !row.range_m || !row.true_range_m) continue;
    // The disparity is that of the near edge; the ranging adds the landmark's radius afterwards.
    sum_m += range_per_pixel_m(run.robot.rig, *row.true_range_m - landmark.radius_m) / 3;
    ++count;
  }
  return count > 0 ? std::optional(sum_m / count) : std::nullopt;
}

}  // namespace twocone::report

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Core>

#include "apps/config/to_layers.h"
#include "apps/estimation/estimator.h"
#include "apps/look/checks.h"
#include "apps/runs/loop/start_check.h"

namespace twocone::look {
namespace {

/// Errors that count are beyond this many of the sigma that vision states: as estimation::kOutsideSigmas, once in a
/// million.
constexpr double kSigmas = estimation::kOutsideSigmas;
/// Nor do errors below these count, as in runs::compare_start: a sigma holds the noise of pixels alone, and a first
/// image without noise has the steps of its pixels besides.
constexpr double kRange_m = runs::kStartWarning_m;
constexpr double kBearing_rad = runs::kStartWarning_deg * std::numbers::pi / 180;

/// Half of what a run warns of: without noise the rim is found to a few tenths of a pixel.
constexpr double kRim_px = 0.5;

/// What vision measured of a landmark, against the map.
struct Sighted {
  std::size_t landmark = 0;
  double range_off_m = 0;
  double bearing_off_rad = 0;
  bool is_off = false;
  double expected_range_m = 0;
};

Sighted compare(std::size_t index, const Landmark& landmark, const localisation::Pose& start,
                const vision::RangeMeasurement& seen) {
  const Eigen::Vector2d to(landmark.x_m - start.x_m, landmark.y_m - start.y_m);
  Sighted result{.landmark = index, .expected_range_m = to.norm()};
  if (seen.range_m) {
    result.range_off_m = *seen.range_m - to.norm();
    result.is_off = std::abs(result.range_off_m) > std::max(kRange_m, kSigmas * seen.sigma_range_m.value_or(0));
  }
  if (seen.bearing_rad) {
    const double expected_rad = std::atan2(to.y(), to.x()) - start.heading_rad;
    result.bearing_off_rad = localisation::wrap_angle_rad(*seen.bearing_rad - expected_rad);
    result.is_off = result.is_off || std::abs(result.bearing_off_rad) >
                                         std::max(kBearing_rad, kSigmas * seen.sigma_bearing_rad.value_or(0));
  }
  return result;
}

std::string describe(const Sighted& seen) {
  return fmt::format("{:+.0f} mm in range (of {:.2f} m) and {:+.2f} degrees in bearing", 1000 * seen.range_off_m,
                     seen.expected_range_m, seen.bearing_off_rad * 180 / std::numbers::pi);
}

}  // namespace

void check_images(const Subject& subject, const Image& lower, const Image& upper, Look& look) {
  const config::Map& map = subject.map;
  const std::vector<std::string> rims = runs::rim_warnings(subject.robot, lower, upper, kRim_px);
  look.notes.insert(look.notes.end(), rims.begin(), rims.end());
  if (rims.empty()) {
    look.checked.push_back(fmt::format("both mirrors' rims in the images against rig:, to {} px", kRim_px));
  }

  const estimation::Estimator estimator(estimation::Method::kOutline, subject.robot, map);
  const auto answer = estimator.answer(lower, upper);
  if (!answer) {
    look.notes.push_back("note: landmarks were not looked for in the images: " + answer.error().message);
    return;
  }
  const localisation::Pose start = config::to_start_pose(subject.robot);
  std::vector<Sighted> sighted;
  std::vector<std::string> unseen;
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    const vision::RangeMeasurement& seen = answer->ranges[i];
    // A landmark whose place is a finding already is not where it is looked for.
    const bool is_named = std::ranges::any_of(look.findings, [&](const Finding& finding) {
      return finding.place == FloorPoint{map.landmarks[i].x_m, map.landmarks[i].y_m};
    });
    if (is_named) continue;
    if (seen.range_m || seen.bearing_rad) {
      sighted.push_back(compare(i, map.landmarks[i], start, seen));
    } else {
      unseen.push_back(fmt::format("{} ({})", map.landmarks[i].name, to_string(seen.verdict)));
    }
  }
  if (!unseen.empty()) {
    look.notes.push_back(fmt::format("note: landmarks without range and bearing from the start: {} (docs/verdicts.md)",
                                     fmt::join(unseen, ", ")));
  }
  if (sighted.empty()) return;
  const auto off = std::size_t(std::ranges::count_if(sighted, &Sighted::is_off));
  // One landmark off is a fault of the map; most of them are one of what all share.
  const bool is_rig = 2 * off > sighted.size();
  for (const Sighted& seen : sighted) {
    if (!seen.is_off) continue;
    const Landmark& landmark = map.landmarks[seen.landmark];
    const std::string text = fmt::format("{}: landmark {} is seen from the start {} off its place on the map",
                                         subject.place_of("landmarks", seen.landmark), landmark.name, describe(seen));
    if (!is_rig) {
      look.findings.push_back({Disagreement::kSighting, text, {landmark.x_m, landmark.y_m}, {}});
    }
  }
  if (is_rig) {
    const auto worst = std::ranges::max_element(sighted, {}, [](const Sighted& s) { return std::abs(s.range_off_m); });
    look.notes.push_back(fmt::format(
        "note: {} of {} landmarks are seen off their places on the map, {} by {}: the robot file's rig: is not that of "
        "the scene's mirrors, or start: is not its place",
        off, sighted.size(), map.landmarks[worst->landmark].name, describe(*worst)));
    return;
  }
  look.checked.push_back(
      fmt::format("{} of {} landmarks, seen from the start, against the map: range to {:.0f} mm, "
                  "bearing to {:.0f} degrees, and {} of their sigmas",
                  sighted.size(), map.landmarks.size(), 1000 * kRange_m, runs::kStartWarning_deg, kSigmas));
}

}  // namespace twocone::look

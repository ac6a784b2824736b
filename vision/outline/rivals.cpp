// SPDX-License-Identifier: Apache-2.0
#include "vision/outline/view_fitter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace twocone::vision {
namespace {

// A rival has at least this share of a landmark's least area. outline_ranging_test.cpp,
// ARivalIsAsLargeAsHalfTheLandmarkAtTheRoomsEnd, fixes it to 0.39 to 0.69.
constexpr double kRivalShare = 0.5;
// Bearings at which the least area is computed. Tuned by hand on synthetic images; no test fixes it.
constexpr int kDirections = 16;
// The finder's top is accurate to a pixel or so, which gives the range, and so the width, to a few per cent. Tuned by
// hand on synthetic images; no test fixes it.
constexpr double kWidthMargin = 1.05;
// A landmark is wider than this many sigmas of its expected width once in 700 cases.
constexpr double kDoubtSigmas = 3;
// Error of a half-covered pixel's direction (Finder::kSureRadius_px), on either side. Tuned by hand on synthetic
// images; outline_ranging_test.cpp, ALandmarkInHalvesIsOneLandmark, exercises it but does not fix it.
constexpr double kEdge_rad = 1.3 * std::numbers::pi / 180;

constexpr double kBin_rad = 2 * std::numbers::pi / Finder::kBins;

/// Returns the radius in the undistorted image at which the view shows that height at that place, at most the rim's; 0
/// where the view does not show it.
double radius_px(const MirrorView& view, const Eigen::Vector2d& place_m, double height_m) {
  const auto shown = view.project_with_jacobian({place_m.x(), place_m.y(), height_m}, Rim::kGoesOn);
  const auto undistorted = shown ? view.undistort_px(shown->pixel_px) : std::nullopt;
  if (!undistorted) return 0;
  return std::min((*undistorted - view.settings().centre_px).norm(), view.settings().rim_radius_px);
}

/// The areas of the circle's bins; at() takes any bin number, modulo the circle.
using Areas = std::vector<double>;
double& at(Areas& areas, int bin) { return areas[std::size_t((bin % Finder::kBins + Finder::kBins) % Finder::kBins)]; }

/// The window of `width` neighbouring bins with the greatest area, among those that begin in [first, last].
struct Window {
  int first;
  double area_px;
};
Window fullest(Areas& areas, int width, int first, int last) {
  Window window{first, 0};
  for (int i = first; i < first + width; ++i) window.area_px += at(areas, i);
  Window best = window;
  for (int i = first + 1; i <= last; ++i) {
    window.area_px += at(areas, i + width - 1) - at(areas, i - 1);
    window.first = i;
    if (window.area_px > best.area_px) best = window;
  }
  return best;
}

/// Returns the greatest number of bins that a landmark with the candidate's top can span.
int width_bins(const ViewFitter& fitter, const Landmark& target, const Candidate& candidate, double width_doubt) {
  const int span = candidate.last_bin - candidate.first_bin + 1;
  // The width is unknown for a landmark that ends beyond the rim.
  if (candidate.at_rim) return span;
  const auto place = fitter.place(candidate, target.radius_m, target.top_m);
  if (!place) return span;
  const double half_rad = std::asin(std::min(1.0, target.radius_m / place->range_m));
  const double margin = kWidthMargin + kDoubtSigmas * width_doubt;
  return std::min(Finder::kBins, static_cast<int>(std::ceil(2 * (margin * half_rad + kEdge_rad) / kBin_rad)));
}

}  // namespace

double least_area_px(const MirrorView& view, const Landmark& target) {
  if (!target.greatest_range_m) return Finder::kLeastArea_px;
  const double range_m = *target.greatest_range_m;
  const double half_rad = std::asin(std::min(1.0, target.radius_m / range_m));
  double least_px = INFINITY;
  for (int i = 0; i < kDirections; ++i) {
    const double bearing_rad = 2 * std::numbers::pi * i / kDirections;
    const Eigen::Vector2d near_m =
        (range_m - target.radius_m) * Eigen::Vector2d(std::cos(bearing_rad), std::sin(bearing_rad));
    const double top_px = radius_px(view, near_m, target.top_m);
    const double foot_px = std::max(radius_px(view, near_m, 0), Finder::kSureRadius_px);
    least_px = std::min(least_px, half_rad * (top_px * top_px - foot_px * foot_px));
  }
  return std::max(least_px, Finder::kLeastArea_px);
}

Rivals rivals_of(const ViewFitter& fitter, const Landmark& target, const Found& found, double least_px,
                 double width_doubt) {
  const Candidate& main = found.candidates.front();
  Areas areas = found.area_px;
  const int width = width_bins(fitter, target, main, width_doubt);
  const int span = main.last_bin - main.first_bin + 1;
  const Window own = fullest(areas, width, std::min(main.first_bin, main.last_bin - width + 1),
                             std::max(main.first_bin, main.last_bin - width + 1));
  for (int i = 0; i < width; ++i) at(areas, own.first + i) = 0;
  const double rival_px = kRivalShare * least_px;
  // Split the remaining area: in the candidate, and elsewhere.
  Areas beside(Finder::kBins, 0);
  for (int i = 0; i < span; ++i) {
    at(beside, main.first_bin + i) = at(areas, main.first_bin + i);
    at(areas, main.first_bin + i) = 0;
  }
  // A candidate that ends beyond the rim may be one half of a landmark whose other half also ends there.
  if (main.at_rim) {
    for (const Candidate& other : found.candidates) {
      if (!other.at_rim) continue;
      for (int i = other.first_bin; i <= other.last_bin; ++i) at(areas, i) = 0;
    }
  }
  if (fullest(areas, width, 0, Finder::kBins - 1).area_px >= rival_px) return Rivals::kApart;
  return fullest(beside, width, 0, Finder::kBins - 1).area_px >= rival_px ? Rivals::kBeside : Rivals::kNone;
}

}  // namespace twocone::vision

// SPDX-License-Identifier: Apache-2.0
#include "tests/support/hyperboloid_mirror.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

namespace twocone::vision {
namespace {

// A point on the rim must not fall outside it by rounding.
constexpr double kRimSlack = 1 + 16 * std::numeric_limits<double>::epsilon();

void check(const HyperboloidMirrorSettings& s) {
  std::string bad;
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  if (!positive(s.half_axis_m)) bad += fmt::format(" half_axis_m is {} m, must be > 0;", s.half_axis_m);
  if (!(s.half_focal_m > s.half_axis_m) || !std::isfinite(s.half_focal_m)) {
    bad += fmt::format(" half_focal_m is {} m, must be > half_axis_m, {} m;", s.half_focal_m, s.half_axis_m);
  }
  if (!positive(s.rim_radius_m)) bad += fmt::format(" rim_radius_m is {} m, must be > 0;", s.rim_radius_m);
  if (!bad.empty()) throw std::invalid_argument("HyperboloidMirror:" + bad);
}

}  // namespace

HyperboloidMirror::HyperboloidMirror(const HyperboloidMirrorSettings& settings) : settings_(settings) {
  check(settings);
  const double a = settings.half_axis_m;
  const double c = settings.half_focal_m;
  b2_m2_ = (c - a) * (c + a);
  const double rim = settings.rim_radius_m;
  rim_slope_ = rim / (c + a * std::sqrt(1 + rim * rim / b2_m2_));
  if (!(b2_m2_ > 0) || !std::isfinite(b2_m2_) || !(rim_slope_ > 0)) {
    throw std::invalid_argument(fmt::format(
        "HyperboloidMirror: half_axis_m {}, half_focal_m {} and rim_radius_m {} m are too large, too small or "
        "too far from one another to compute with",
        a, c, rim));
  }
}

std::optional<double> HyperboloidMirror::slope(double distance_m, double height_m) const {
  if (!std::isfinite(distance_m) || !std::isfinite(height_m) || distance_m < 0) return std::nullopt;
  const double up_m = height_m - viewpoint_m();
  const double away_m = std::hypot(distance_m, up_m);
  // This is t = b^2 / (a - c sin e), with numerator and denominator times the point's distance from F. At
  // elevations beyond the asymptote's there is no mirror, and the denominator is negative.
  const double towards = settings_.half_axis_m * away_m - settings_.half_focal_m * up_m;
  if (!(towards >= b2_m2_)) return std::nullopt;
  const double part = b2_m2_ / towards;  // share of the distance from F to the point, at most 1
  const double slope = part * distance_m / (viewpoint_m() + part * up_m);
  if (!(slope >= 0) || !(slope <= rim_slope_ * kRimSlack)) return std::nullopt;
  return slope;
}

std::optional<double> HyperboloidMirror::elevation_rad(double slope) const {
  if (!(slope >= 0) || !(slope <= rim_slope_ * kRimSlack)) return std::nullopt;
  const double a = settings_.half_axis_m;
  const double height_m =
      b2_m2_ * (settings_.half_focal_m + a * std::sqrt(1 + slope * slope)) / (b2_m2_ - a * a * slope * slope);
  const double elevation = std::atan2(height_m - viewpoint_m(), slope * height_m);
  if (!std::isfinite(elevation)) return std::nullopt;
  return elevation;
}

}  // namespace twocone::vision

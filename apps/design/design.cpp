// SPDX-License-Identifier: Apache-2.0
#include "apps/design/design.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/design/sight.h"
#include "apps/design/units.h"
#include "vision/dense_ranging.h"
#include "vision/mirror_view.h"

namespace twocone::design {
namespace {

/// The rim stays inside of the image by this much, for a camera that is not quite in the axis.
constexpr double kRimMargin_px = 4;
constexpr double kLeastRadius_m = 0.015;
constexpr double kMillimetre_m = 0.001;
/// Sums of millimetres are off by less, in millimetres.
constexpr double kRounding = 1e-6;
/// Room for the rounding of the measures.
constexpr double kRounding_rad = 0.15 * kDegree;

double up_to(double value, double step) { return std::ceil(value / step - 1e-9) * step; }
int floor_mm(double length_m) { return static_cast<int>(std::floor(length_m / kMillimetre_m + kRounding)); }
int ceil_mm(double length_m) { return static_cast<int>(std::ceil(length_m / kMillimetre_m - kRounding)); }

void check(const Requirements& r) {
  base::Complaints bad;
  constexpr int kLeast_px = 120;
  bad.within("width_px", r.width_px, kLeast_px, 16384);
  bad.within("height_px", r.height_px, kLeast_px, 16384);
  bad.require(r.camera_angle_rad > 5 * kDegree && r.camera_angle_rad < 150 * kDegree,
              "the camera's angle is {:.4g} degrees, must be 5 to 150", in_degrees(r.camera_angle_rad));
  bad.require(r.lowest_rad > -60 * kDegree && r.highest_rad < 60 * kDegree && r.lowest_rad < r.highest_rad,
              "the elevations are {:.4g} to {:.4g} degrees, must be within -60 to 60, the lowest first",
              in_degrees(r.lowest_rad), in_degrees(r.highest_rad));
  if (r.floor_from_m) bad.positive("floor_from_m", *r.floor_from_m, "m");
  bad.positive("sigma_m", r.sigma_m, "m");
  bad.positive("at_m", r.at_m, "m");
  bad.positive("sigma_px", r.sigma_px, "px");
  bad.require(r.greatest_radius_m >= kLeastRadius_m && std::isfinite(r.greatest_radius_m),
              "the mirrors' greatest radius is {} m, must be at least {}", r.greatest_radius_m, kLeastRadius_m);
  bad.positive("greatest_height_m", r.greatest_height_m, "m");
  bad.positive("lens_height_m", r.lens_height_m, "m");
  bad.positive("body_radius_m", r.body_radius_m, "m");
  bad.raise("design");
}

/// The image of a camera that looks at a mirror.
struct Image {
  explicit Image(const Requirements& requirements, double camera_angle_rad)
      : half_px(std::min(requirements.width_px, requirements.height_px) / 2.0),
        focal_px(half_px / std::tan(camera_angle_rad / 2)),
        rim_px(half_px - kRimMargin_px),
        inner_rad(std::atan(vision::kInnermost_px / focal_px)),
        outer_rad(std::atan(rim_px / focal_px)) {}
  double half_px, focal_px, rim_px;
  double inner_rad, outer_rad;  ///< from the axis
  [[nodiscard]] double band_rad() const { return outer_rad - inner_rad - kRounding_rad; }
};

/// What is decided before the separation.
struct Unit {
  double apex_rad, radius_m, tip_m, rim_px;
  [[nodiscard]] double cone_m() const { return radius_m / std::tan(apex_rad / 2); }
  /// From the lens to the back of the mirror's plate.
  [[nodiscard]] double length_m() const { return tip_m + cone_m() + kPlate_m; }
};

/// Returns the unit of a mirror of that radius whose lowest elevation is so low.
Unit unit_of(const Image& image, double lowest_rad, double radius_m) {
  const double apex_rad = up_to(in_degrees(std::numbers::pi / 2 + image.inner_rad - lowest_rad), 0.1) * kDegree;
  const double cot = 1 / std::tan(apex_rad / 2);
  const double tip_m = up_to(radius_m * (image.focal_px / image.rim_px - cot), kMillimetre_m / 2);
  return {apex_rad, radius_m, tip_m, image.focal_px / (tip_m / radius_m + cot)};
}

Design made(const Requirements& r, const Unit& unit, double separation_m) {
  return {r.width_px,   r.height_px,     unit.apex_rad, unit.radius_m,  unit.tip_m,
          separation_m, r.lens_height_m, unit.rim_px,   r.body_radius_m};
}

/// Returns the greatest sigma of a range at r.at_m; infinite where both mirrors show nothing there.
double worst_sigma_m(const Requirements& r, const Unit& unit, double separation_m) {
  const Sight sight = sight_of(made(r, unit, separation_m));
  const auto shared = sight.shared_heights(r.at_m);
  if (!shared) return std::numeric_limits<double>::infinity();
  double worst_m = 0;
  constexpr int kSteps = 8;
  for (int k = 0; k <= kSteps; ++k) {
    const double height_m = std::lerp(shared->lowest_m, shared->highest_m, (k + 0.01) / (kSteps + 0.02));
    worst_m = std::max(worst_m, sight.range_sigma_m(r.at_m, height_m, r.sigma_px).value_or(0));
  }
  return worst_m;
}

/// A separation with the greatest sigma of a range at Requirements::at_m.
struct Accuracy {
  double separation_m, sigma_m;
};
/// Returns the least separation that is accurate enough, in whole millimetres; if there is none, the most accurate one,
/// because the mirrors have the less in common the farther they are apart; nothing: two mirrors are too high.
std::optional<Accuracy> separation_for(const Requirements& r, const Unit& unit) {
  const auto accuracy_of = [&](int millimetres) {
    const double separation_m = millimetres * kMillimetre_m;
    return Accuracy{separation_m, worst_sigma_m(r, unit, separation_m)};
  };
  const int greatest_mm = floor_mm(r.greatest_height_m - r.lens_height_m - unit.length_m());
  const int least_mm = ceil_mm(unit.length_m() + kCamera_m);
  constexpr int kCoarse_mm = 20;
  std::optional<Accuracy> best;
  int bad_mm = least_mm - 1;
  for (int mm = least_mm; mm <= greatest_mm; mm += kCoarse_mm) {
    const Accuracy here = accuracy_of(mm);
    if (!best || here.sigma_m < best->sigma_m) best = here;
    if (here.sigma_m <= r.sigma_m) break;
    bad_mm = mm;
  }
  if (!best || best->sigma_m > r.sigma_m) return best;
  for (int mm = bad_mm + 1; mm < ceil_mm(best->separation_m); ++mm) {
    const Accuracy here = accuracy_of(mm);
    if (here.sigma_m <= r.sigma_m) return here;
  }
  return best;
}

/// Returns the largest mirrors that do for this lowest elevation.
/// @param nearest_floor_m becomes the least distance of the floor among those that do but for it, if that is less
std::optional<Design> largest(const Requirements& r, const Image& image, double lowest_rad,
                              std::optional<double>& nearest_floor_m) {
  for (int radius_mm = floor_mm(r.greatest_radius_m); radius_mm >= ceil_mm(kLeastRadius_m); --radius_mm) {
    const Unit unit = unit_of(image, lowest_rad, radius_mm * kMillimetre_m);
    if (unit.tip_m < kLeastLensToTip_m) break;
    const auto accuracy = separation_for(r, unit);
    if (!accuracy || accuracy->sigma_m > r.sigma_m) continue;
    const Design found = made(r, unit, accuracy->separation_m);
    if (!r.floor_from_m) return found;
    const auto floor_m = sight_of(found).floor_from_m();
    if (floor_m && *floor_m <= *r.floor_from_m) return found;
    if (floor_m) nearest_floor_m = std::min(nearest_floor_m.value_or(*floor_m), *floor_m);
  }
  return std::nullopt;
}

/// What design() finds, and what it needs to say why there is nothing.
struct Attempt {
  std::optional<Design> found;
  double spare_rad;  ///< of the image's band, beyond what is required
  std::optional<double> nearest_floor_m;
};
Attempt attempt(const Requirements& requirements) {
  const Image image(requirements, requirements.camera_angle_rad);
  Attempt result{{}, image.band_rad() - (requirements.highest_rad - requirements.lowest_rad), {}};
  // From equal shares of what the image shows beyond the requirements, down to all of it below, as the floor needs it.
  constexpr int kShares = 20;
  for (int k = 0; k <= (requirements.floor_from_m ? kShares : 0) && result.spare_rad >= 0 && !result.found; ++k) {
    const double below_rad = result.spare_rad * (0.5 + 0.5 * k / kShares);
    result.found = largest(requirements, image, requirements.lowest_rad - below_rad, result.nearest_floor_m);
  }
  return result;
}

/// Requirements that are near to those that cannot be, and what they are called.
struct Near {
  std::string words;
  Requirements requirements;
};
/// Returns "; nearest: A, or B" with those that can be.
std::string nearest(const std::vector<Near>& all) {
  std::string words;
  for (const Near& near : all) {
    if (attempt(near.requirements).found) words += (words.empty() ? "; nearest: " : ", or ") + near.words;
  }
  return words.empty() ? "; nothing near can be: require less of several things" : words;
}
Requirements with(Requirements requirements, double Requirements::*what, double value) {
  requirements.*what = value;
  return requirements;
}
/// Returns the value nearest to the required one for which there are such mirrors, to 1 %; a far one if there is none.
/// @param factor by which the value is changed
double first_that_can(Requirements requirements, double Requirements::*what, double factor) {
  constexpr int kMost = 20;
  constexpr double kPrecise = 0.01;
  double cannot = requirements.*what;
  for (int k = 0; k < kMost; ++k) {
    requirements.*what *= factor;
    if (attempt(requirements).found) break;
    cannot = requirements.*what;
  }
  double can = requirements.*what;
  while (std::abs(can - cannot) > kPrecise * can) {
    const double middle = (can + cannot) / 2;
    (attempt(with(requirements, what, middle)).found ? can : cannot) = middle;
  }
  return can;
}

[[noreturn]] void refuse_band(const Requirements& r) {
  const double band_rad = Image(r, r.camera_angle_rad).band_rad();
  const double required_rad = r.highest_rad - r.lowest_rad;
  const double highest_deg = std::floor(10 * in_degrees(r.lowest_rad + band_rad)) / 10;
  const double lowest_deg = std::ceil(10 * in_degrees(r.highest_rad - band_rad)) / 10;
  std::vector<Near> near{
      {fmt::format("a highest elevation of {:.1f} degrees", highest_deg),
       with(r, &Requirements::highest_rad, highest_deg * kDegree)},
      {fmt::format("a lowest one of {:.1f}", lowest_deg), with(r, &Requirements::lowest_rad, lowest_deg * kDegree)}};
  for (int angle_deg = static_cast<int>(std::ceil(in_degrees(r.camera_angle_rad))); angle_deg < 150; ++angle_deg) {
    if (Image(r, angle_deg * kDegree).band_rad() < required_rad) continue;
    near.push_back({fmt::format("a camera of {} degrees", angle_deg),
                    with(r, &Requirements::camera_angle_rad, angle_deg * kDegree)});
    break;
  }
  throw CannotBe(
      "elevations from {:.4g} to {:.4g} degrees are a band of {:.4g} degrees, and a camera of {:.4g} degrees shows "
      "{:.1f} in a mirror{}",
      in_degrees(r.lowest_rad), in_degrees(r.highest_rad), in_degrees(required_rad), in_degrees(r.camera_angle_rad),
      in_degrees(band_rad), nearest(near));
}

/// Refuses what is left when the image's band is wide enough.
[[noreturn]] void refuse(const Requirements& r, const Attempt& tried) {
  if (tried.nearest_floor_m) {
    Requirements farther = r;
    farther.floor_from_m = std::ceil(100 * *tried.nearest_floor_m) / 100;
    throw CannotBe("both mirrors see the floor from {:.2f} m on at best, and {:.2f} m are required{}",
                   *tried.nearest_floor_m, *r.floor_from_m,
                   nearest({{fmt::format("{:.2f} m", *farther.floor_from_m), farther}}));
  }
  const Image image(r, r.camera_angle_rad);
  const double lowest_rad = r.lowest_rad - tried.spare_rad / 2;
  const Unit largest_unit = unit_of(image, lowest_rad, r.greatest_radius_m);
  if (largest_unit.tip_m < kLeastLensToTip_m) {
    const double angle_rad = first_that_can(r, &Requirements::camera_angle_rad, 0.9);
    const double radius_m = first_that_can(r, &Requirements::greatest_radius_m, 1.1);
    throw CannotBe(
        "a mirror of radius {:.0f} mm and {:.1f} degrees would be {:.1f} mm from the lens of a camera of {:.4g} "
        "degrees, "
        "must be at least {:.0f} mm{}",
        in_mm(r.greatest_radius_m), in_degrees(largest_unit.apex_rad), in_mm(largest_unit.tip_m),
        in_degrees(r.camera_angle_rad), in_mm(kLeastLensToTip_m),
        nearest({{fmt::format("mirrors of radius {:.0f} mm", std::ceil(in_mm(radius_m))),
                  with(r, &Requirements::greatest_radius_m, std::ceil(in_mm(radius_m)) / 1000)},
                 {fmt::format("a camera of {:.1f} degrees", in_degrees(angle_rad)),
                  with(r, &Requirements::camera_angle_rad, angle_rad)}}));
  }
  // The smallest mirrors leave most room for the separation.
  double radius_m = kLeastRadius_m;
  while (unit_of(image, lowest_rad, radius_m).tip_m < kLeastLensToTip_m) radius_m += kMillimetre_m;
  const auto best = separation_for(r, unit_of(image, lowest_rad, radius_m));
  const double height_m = first_that_can(r, &Requirements::greatest_height_m, 1.1);
  const Near taller{fmt::format("a greatest height of {:.0f} mm", std::ceil(in_mm(height_m))),
                    with(r, &Requirements::greatest_height_m, std::ceil(in_mm(height_m)) / 1000)};
  if (!best) {
    throw CannotBe("two mirrors with their cameras over a lens at {:.0f} mm are higher than {:.0f} mm{}",
                   in_mm(r.lens_height_m), in_mm(r.greatest_height_m), nearest({taller}));
  }
  if (!std::isfinite(best->sigma_m)) {
    const double at_m = first_that_can(r, &Requirements::at_m, 1.1);
    throw CannotBe("both mirrors show nothing in common {:.3g} m away{}", r.at_m,
                   nearest({{fmt::format("the same sigma at {:.2f} m", at_m), with(r, &Requirements::at_m, at_m)}}));
  }
  const double sigma_m = std::ceil(1e4 * best->sigma_m) / 1e4;
  throw CannotBe(
      "a range at {:.3g} m can have a sigma of {:.1f} mm at best within a height of {:.0f} mm, and {:.1f} mm are "
      "required{}",
      r.at_m, in_mm(best->sigma_m), in_mm(r.greatest_height_m), in_mm(r.sigma_m),
      nearest({{fmt::format("{:.1f} mm", in_mm(sigma_m)), with(r, &Requirements::sigma_m, sigma_m)}, taller}));
}

}  // namespace

double Design::cone_height_m() const { return mirror_radius_m / std::tan(apex_rad / 2); }

Sight sight_of(const Design& design) {
  const auto view = [&](double lens_m) {
    return vision::MirrorView({.cone = {design.apex_rad, design.mirror_radius_m, design.lens_to_tip_m},
                               .lens_height_m = lens_m,
                               .centre_px = {(design.width_px - 1) / 2.0, (design.height_px - 1) / 2.0},
                               .rim_radius_px = design.rim_radius_px});
  };
  return Sight({view(design.lens_height_m), view(design.lens_height_m + design.mirror_separation_m)});
}

Design design(const Requirements& requirements) {
  check(requirements);
  const Attempt tried = attempt(requirements);
  if (tried.found) return *tried.found;
  if (tried.spare_rad < 0) refuse_band(requirements);
  if (!tried.nearest_floor_m && requirements.floor_from_m) {
    // Something else cannot be, or no pair for the other requirements ever sees the floor.
    Requirements others = requirements;
    others.floor_from_m.reset();
    const Attempt without = attempt(others);
    if (!without.found) refuse(others, without);
    throw CannotBe("both mirrors never see the floor with elevations from {:.4g} degrees on; a lower one is required",
                   in_degrees(requirements.lowest_rad));
  }
  refuse(requirements, tried);
}

}  // namespace twocone::design

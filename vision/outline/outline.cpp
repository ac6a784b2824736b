// SPDX-License-Identifier: Apache-2.0
#include "vision/outline/outline_fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace twocone::vision {
namespace {

constexpr double kHuge_px = 1e6;  // wider than any image
// Steps of forward differences: small against the lengths over which a projection curves, large against its rounding.
constexpr double kRangeStep = 1e-5;  // share of the range
constexpr double kBearingStep_rad = 1e-5;
constexpr double kWidthStep = 1e-4;  // share of the radius

using Pixels = std::array<Eigen::Vector2d, Outline::kVertices>;

/// Computes the chain's vertices for one cylinder. The sides begin at the height `bottom_m`.
bool chain(const MirrorView& view, const Cylinder& c, double bottom_m, Pixels& pixels) {
  const Eigen::Vector2d axis_m = view.settings().axis_offset_m;
  const Eigen::Vector2d place_m = c.place_m();
  const Eigen::Vector2d outwards = place_m - axis_m;
  const double distance_m = outwards.norm();
  if (!(distance_m > c.radius_m)) return false;
  const Eigen::Vector2d away = outwards / distance_m;
  const Eigen::Vector2d across(-away.y(), away.x());
  const double tangent_rad = std::acos(c.radius_m / distance_m);

  int at = 0;
  bool is_shown = true;
  const auto add = [&](double angle_rad, double height_m) {
    const Eigen::Vector2d p =
        place_m - away * (c.radius_m * std::cos(angle_rad)) + across * (c.radius_m * std::sin(angle_rad));
    const auto pixel = view.project({p.x(), p.y(), height_m});
    is_shown = is_shown && pixel;
    if (is_shown) pixels[std::size_t(at++)] = *pixel;
  };
  const auto side_height = [&](int i) { return bottom_m + (c.top_m - bottom_m) * i / Outline::kSideSegments; };
  for (int i = 0; i < Outline::kSideSegments; ++i) add(-tangent_rad, side_height(i));
  for (int i = 0; i <= Outline::kArcSegments; ++i) add(tangent_rad * (2.0 * i / Outline::kArcSegments - 1), c.top_m);
  for (int i = Outline::kSideSegments - 1; i >= 0; --i) add(tangent_rad, side_height(i));
  return is_shown;
}

/// Returns the height over the floor that the view shows at `radius_px` at the cylinder's axis, not below the floor.
std::optional<double> height_at(const MirrorView& view, const Cylinder& c, double radius_px) {
  const MirrorViewSettings& s = view.settings();
  const auto ray = view.back_project(s.centre_px + view.offset_px(c.bearing_rad, radius_px));
  if (!ray) return std::nullopt;
  const double out = ray->direction.head<2>().norm();
  if (!(out > 0)) return std::nullopt;
  const double way = (c.range_m - ray->origin_m.head<2>().norm()) / out;
  return std::max(0.0, ray->origin_m.z() + way * ray->direction.z());
}

}  // namespace

std::optional<Outline> make_outline(const MirrorView& view, const Cylinder& cylinder, double least_radius_px) {
  const auto bottom_m = height_at(view, cylinder, least_radius_px);
  if (!bottom_m || !(*bottom_m < cylinder.top_m)) return std::nullopt;
  Pixels here;
  Pixels farther;
  Pixels turned;
  Cylinder moved = cylinder;
  const double range_step_m = kRangeStep * cylinder.range_m;
  moved.range_m += range_step_m;
  if (!chain(view, cylinder, *bottom_m, here) || !chain(view, moved, *bottom_m, farther)) return std::nullopt;
  moved.range_m = cylinder.range_m;
  moved.bearing_rad += kBearingStep_rad;
  if (!chain(view, moved, *bottom_m, turned)) return std::nullopt;

  Pixels wider = here;
  if (cylinder.width_doubt > 0) {
    const double step_m = kWidthStep * cylinder.radius_m;
    const Eigen::Vector2d place_m = cylinder.place_m();
    moved = cylinder.at(place_m + step_m * (place_m - view.settings().axis_offset_m).normalized());
    moved.radius_m += step_m;
    if (!chain(view, moved, *bottom_m, wider)) return std::nullopt;
  }

  Outline outline;
  for (int i = 0; i < Outline::kVertices; ++i) {
    const auto k = std::size_t(i);
    Outline::Vertex& v = outline.vertices[k];
    v.pixel_px = here[k];
    v.by_range_pxpm = (farther[k] - here[k]) / range_step_m;
    v.by_bearing_pxprad = (turned[k] - here[k]) / kBearingStep_rad;
    v.by_width_px = (wider[k] - here[k]) / kWidthStep;
    const Eigen::Vector2d from_near = here[k] - here[Outline::kNear];
    v.by_lean_px = {-from_near.y(), from_near.x()};
    const int opposite = Outline::kVertices - 1 - i;
    const bool is_side = std::min(i, opposite) <= Outline::kSideSegments;
    v.chord_px = (here[k] - here[std::size_t(opposite)]).norm();
    v.width_px = is_side ? v.chord_px : kHuge_px;
    v.bulge_px.setZero();
  }
  // The bulge is the cubic interpolation through four vertices at equal steps minus the chord, at the middle. The first
  // and the last segment of a part repeat their neighbour's curvature.
  constexpr int kArcEnd = Outline::kSideSegments + Outline::kArcSegments;
  for (const auto& [begin, end] :
       {std::pair{0, Outline::kSideSegments}, {Outline::kSideSegments, kArcEnd}, {kArcEnd, Outline::kVertices - 1}}) {
    for (int i = begin; i < end; ++i) {
      const auto first = std::size_t(std::clamp(i - 1, begin, end - 3));
      outline.vertices[std::size_t(i)].bulge_px =
          (here[first + 1] + here[first + 2] - here[first] - here[first + 3]) / 16;
    }
  }
  return outline;
}

}  // namespace twocone::vision

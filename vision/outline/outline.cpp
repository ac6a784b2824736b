// SPDX-License-Identifier: Apache-2.0
#include "vision/outline/outline_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "vision/bands/band_code.h"

namespace twocone::vision {
namespace {

constexpr double kHuge_px = 1e6;  // wider than any image
// Steps of forward differences: small against the lengths over which a projection curves, large against its rounding.
constexpr double kRangeStep = 1e-5;  // share of the range
constexpr double kBearingStep_rad = 1e-5;
constexpr double kWidthStep = 1e-4;  // share of the radius
constexpr double kHeightStep_m = 1e-5;

/// A place on a cylinder's surface: its height, and its turn from the middle of the side that faces the view, or from
/// that of the far side, as a share of the turn to where planes through the view's axis touch it, -1 to 1.
struct Place {
  double turn, height_m;
  bool is_far = false;
};
using Pixels = std::vector<Eigen::Vector2d>;

/// Projects places on one cylinder. Returns false where the view does not show all of them.
bool project(const MirrorView& view, const Cylinder& c, std::span<const Place> places, Rim rim, Pixels& pixels) {
  const Eigen::Vector2d axis_m = view.settings().axis_offset_m;
  const Eigen::Vector2d place_m = c.place_m();
  const Eigen::Vector2d outwards = place_m - axis_m;
  const double distance_m = outwards.norm();
  if (!(distance_m > c.radius_m)) return false;
  const Eigen::Vector2d away = outwards / distance_m;
  const Eigen::Vector2d across(-away.y(), away.x());
  const double tangent_rad = std::acos(c.radius_m / distance_m);

  pixels.clear();
  for (const auto& [turn, height_m, is_far] : places) {
    const double angle_rad = is_far ? std::numbers::pi - (std::numbers::pi - tangent_rad) * turn : tangent_rad * turn;
    const Eigen::Vector2d p =
        place_m - away * (c.radius_m * std::cos(angle_rad)) + across * (c.radius_m * std::sin(angle_rad));
    if (rim == Rim::kEnds) {
      const auto pixel = view.project({p.x(), p.y(), height_m});
      if (!pixel) return false;
      pixels.push_back(*pixel);
    } else {
      const auto shown = view.project_with_jacobian({p.x(), p.y(), height_m}, rim);
      if (!shown) return false;
      pixels.push_back(shown->pixel_px);
    }
  }
  return true;
}

/// The places of a chain: up one side, along the rim, down the other side. The sides begin at the height `bottom_m`.
std::vector<Place> chain_of(const Cylinder& c, double bottom_m, bool is_far_rim) {
  std::vector<Place> places;
  places.reserve(Outline::kVertices);
  const auto side_height = [&](int i) { return bottom_m + (c.top_m - bottom_m) * i / Outline::kSideSegments; };
  for (int i = 0; i < Outline::kSideSegments; ++i) places.push_back({-1, side_height(i)});
  for (int i = 0; i <= Outline::kArcSegments; ++i) {
    places.push_back({2.0 * i / Outline::kArcSegments - 1, c.top_m, is_far_rim});
  }
  for (int i = Outline::kSideSegments - 1; i >= 0; --i) places.push_back({1, side_height(i)});
  return places;
}

/// Computes vertices, but for what depends on their neighbours. Returns false where the view does not show them.
bool make_vertices(const MirrorView& view, const Cylinder& cylinder, std::span<const Place> places, Rim rim,
                   const Eigen::Vector2d& near_px, std::span<Outline::Vertex> vertices) {
  Pixels here;
  Pixels farther;
  Pixels turned;
  Cylinder moved = cylinder;
  const double range_step_m = kRangeStep * cylinder.range_m;
  moved.range_m += range_step_m;
  if (!project(view, cylinder, places, rim, here) || !project(view, moved, places, rim, farther)) return false;
  moved.range_m = cylinder.range_m;
  moved.bearing_rad += kBearingStep_rad;
  if (!project(view, moved, places, rim, turned)) return false;

  Pixels wider = here;
  if (cylinder.width_doubt > 0) {
    const double step_m = kWidthStep * cylinder.radius_m;
    const Eigen::Vector2d place_m = cylinder.place_m();
    moved = cylinder.at(place_m + step_m * (place_m - view.settings().axis_offset_m).normalized());
    moved.radius_m += step_m;
    if (!project(view, moved, places, rim, wider)) return false;
  }
  Pixels higher = here;
  if (cylinder.height_doubt_m > 0) {
    std::vector<Place> raised(places.begin(), places.end());
    for (Place& place : raised) place.height_m += kHeightStep_m;
    if (!project(view, cylinder, raised, rim, higher)) return false;
  }
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    Outline::Vertex& v = vertices[k];
    v.by_height_pxpm = (higher[k] - here[k]) / kHeightStep_m;
    v.pixel_px = here[k];
    v.by_range_pxpm = (farther[k] - here[k]) / range_step_m;
    v.by_bearing_pxprad = (turned[k] - here[k]) / kBearingStep_rad;
    v.by_width_px = (wider[k] - here[k]) / kWidthStep;
    const Eigen::Vector2d from_near = here[k] - near_px;
    v.by_lean_px = {-from_near.y(), from_near.x()};
    v.bulge_px.setZero();
  }
  return true;
}

/// Bends the segments between `begin` and `end`, three or more. The bulge is the cubic interpolation through four
/// vertices at equal steps minus the chord, at the middle. The first and the last segment repeat their neighbour's
/// curvature.
void bend(std::span<Outline::Vertex> vertices, int begin, int end) {
  for (int i = begin; i < end; ++i) {
    const auto first = std::size_t(std::clamp(i - 1, begin, end - 3));
    const auto at = [&](std::size_t k) { return vertices[first + k].pixel_px; };
    vertices[std::size_t(i)].bulge_px = (at(1) + at(2) - at(0) - at(3)) / 16;
  }
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

/// The edges of the bands that the view shows.
class BandStrands {
 public:
  /// @param bottom_m height at which the sides begin
  BandStrands(const MirrorView& view, const Cylinder& cylinder, double bottom_m, const Outline& outline)
      : view_(view), cylinder_(cylinder), bottom_m_(bottom_m), near_px_(outline.near.pixel_px) {
    const BandCells cells = band_cells(cylinder.bands->number);
    const double top_m = cylinder.top_m + double(kCellsOverLine) * cylinder.bands->cell_m;
    // Bands from the top down: where each begins, and where the last ends.
    std::vector<double> edges_m;
    for (std::size_t k = 0; k < kBandCells; ++k) {
      if (k == 0 || cells[k] != cells[k - 1]) edges_m.push_back(top_m - double(k) * cylinder.bands->cell_m);
    }
    edges_m.push_back(top_m - double(kBandCells) * cylinder.bands->cell_m);
    bool is_light = cells[0];
    for (std::size_t i = 0; i + 1 < edges_m.size(); ++i, is_light = !is_light) {
      if (i > 0) add_arc(edges_m[i - 1], edges_m[i], edges_m[i + 1], is_light);
      for (const Outline::Part side : {Outline::kLeft, Outline::kRight}) {
        add_side(side, edges_m[i], edges_m[i + 1], is_light);
      }
    }
  }

  [[nodiscard]] std::vector<Outline::Strand> take() { return std::move(strands_); }

 private:
  /// Returns the radius in the image at which the near side shows a height; nothing below the bottom and beyond the
  /// rim.
  [[nodiscard]] std::optional<double> radius_px(double height_m) const {
    if (height_m < bottom_m_) return std::nullopt;
    Pixels near;
    const Place place{0, height_m};
    if (!project(view_, cylinder_, {&place, 1}, Rim::kEnds, near)) return std::nullopt;
    return (near.front() - view_.settings().centre_px).norm();
  }

  void add_arc(double over_m, double height_m, double under_m, bool is_light_under) {
    const auto over_px = radius_px(over_m);
    const auto at_px = radius_px(height_m);
    const auto under_px = radius_px(under_m);
    if (!over_px || !at_px || !under_px) return;
    std::vector<Place> places;
    for (int i = 0; i <= kSegments; ++i) places.push_back({kArcShare * (2.0 * i / kSegments - 1), height_m});
    Outline::Strand arc{.part = Outline::kArc,
                        .vertices = std::vector<Outline::Vertex>(places.size()),
                        .inside = {*under_px, *at_px, is_light_under},
                        .outside = Outline::Band{*at_px, *over_px, !is_light_under}};
    if (!make_vertices(view_, cylinder_, places, Rim::kEnds, near_px_, arc.vertices)) return;
    bend(arc.vertices, 0, kSegments);
    const double chord_px = (arc.vertices.back().pixel_px - arc.vertices.front().pixel_px).norm() / kArcShare;
    for (Outline::Vertex& v : arc.vertices) {
      v.chord_px = chord_px;
      v.width_px = kHuge_px;
    }
    strands_.push_back(std::move(arc));
  }

  void add_side(Outline::Part side, double upper_m, double lower_m, bool is_light) {
    const auto upper_px = radius_px(upper_m);
    const auto lower_px = radius_px(lower_m);
    if (!upper_px || !lower_px || *upper_px <= *lower_px) return;
    const double turn = side == Outline::kLeft ? -1 : 1;
    const std::array own{Place{turn, lower_m}, Place{turn, upper_m}};
    const std::array other{Place{-turn, own[0].height_m}, Place{-turn, own[1].height_m}};
    Outline::Strand strand{.part = side,
                           .vertices = std::vector<Outline::Vertex>(own.size()),
                           .inside = {*lower_px, *upper_px, is_light},
                           .outside = std::nullopt};
    Pixels opposite;
    if (!make_vertices(view_, cylinder_, own, Rim::kEnds, near_px_, strand.vertices) ||
        !project(view_, cylinder_, other, Rim::kEnds, opposite)) {
      return;
    }
    for (std::size_t i = 0; i < opposite.size(); ++i) {
      strand.vertices[i].chord_px = strand.vertices[i].width_px = (strand.vertices[i].pixel_px - opposite[i]).norm();
    }
    strands_.push_back(std::move(strand));
  }

  static constexpr int kSegments = 8;
  // Beside its sides a cylinder is seen too flat.
  static constexpr double kArcShare = 0.85;

  const MirrorView& view_;
  const Cylinder& cylinder_;
  double bottom_m_;
  Eigen::Vector2d near_px_;
  std::vector<Outline::Strand> strands_;
};

}  // namespace

std::optional<Outline> make_outline(const MirrorView& view, const Cylinder& cylinder, double least_radius_px) {
  const auto bottom_m = height_at(view, cylinder, least_radius_px);
  if (!bottom_m || !(*bottom_m < cylinder.top_m)) return std::nullopt;
  Outline outline;
  outline.tip_px = view.settings().centre_px;
  // The line of bands may lie beyond the rim, and bands below it be seen.
  const Rim rim = cylinder.bands ? Rim::kGoesOn : Rim::kEnds;
  const Place near{0, cylinder.top_m};
  Pixels near_px;
  if (!project(view, cylinder, {&near, 1}, rim, near_px)) return std::nullopt;
  // The line of bands is on the side that faces the view, wherever the view is.
  const auto ray = view.back_project(near_px.front(), Rim::kGoesOn);
  const bool is_far_rim = !cylinder.bands && ray && ray->looks_down();
  if (!make_vertices(view, cylinder, {&near, 1}, rim, near_px.front(), {&outline.near, 1}) ||
      !make_vertices(view, cylinder, chain_of(cylinder, *bottom_m, is_far_rim), rim, near_px.front(),
                     outline.vertices)) {
    return std::nullopt;
  }
  for (int i = 0; i < Outline::kVertices; ++i) {
    Outline::Vertex& v = outline.vertices[std::size_t(i)];
    const int opposite = Outline::kVertices - 1 - i;
    const bool is_side = std::min(i, opposite) <= Outline::kSideSegments;
    v.chord_px = (v.pixel_px - outline.vertices[std::size_t(opposite)].pixel_px).norm();
    v.width_px = is_side ? v.chord_px : kHuge_px;
  }
  constexpr int kArcEnd = Outline::kSideSegments + Outline::kArcSegments;
  bend(outline.vertices, 0, Outline::kSideSegments);
  bend(outline.vertices, Outline::kSideSegments, kArcEnd);
  bend(outline.vertices, kArcEnd, Outline::kVertices - 1);
  if (cylinder.bands) outline.strands = BandStrands(view, cylinder, *bottom_m, outline).take();
  return outline;
}

}  // namespace twocone::vision

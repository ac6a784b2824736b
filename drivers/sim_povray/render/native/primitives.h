// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "drivers/sim_povray/render/native/ray.h"
#include "drivers/sim_povray/scene/evaluated_scene.h"

/// Shapes in the forms in which they are traced. Each has
/// - `cross(ray, found)`, which calls `found(t, patch)` for every crossing in any order; t may be infinite;
/// - `normal(ray, t, patch)`, the outward normal there, not of length 1;
/// - `contains(point)`, by POV-Ray's rules, those for points on the surface included (see kConeMargin);
/// - `bounds()`, none if it is infinite.
/// Where `frame` is, it leads from the form's own coordinates to the scene's. A ray is moved there and its direction
/// not normalised, so that t stays the same.
namespace twocone::sim_povray {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Below it, the square of a number has fewer digits than the number: a direction with so small a part is parallel.
inline constexpr double kSmallestSquare = std::numeric_limits<double>::min() / std::numeric_limits<double>::epsilon();

inline double component(const Vec3& v, std::size_t axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

/// A stretch of a ray.
struct RaySpan {
  double low = -kInfinity;
  double high = kInfinity;

  /// Keeps what lies between two parallel planes. @returns whether anything may be left
  bool cut(double origin, double slope, double from, double to) {
    if (slope == 0) return from <= origin && origin <= to;
    const double a = (from - origin) / slope;
    const double b = (to - origin) / slope;
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
    return low <= high;
  }
};

/// What never meets a ray, such as a cylinder of length 0.
struct Nothing {
  template <class Found>
  void cross(const Ray& /*ray*/, Found&& /*found*/) const {}
  [[nodiscard]] Vec3 normal(const Ray& ray, double /*t*/, int /*patch*/) const { return -ray.direction; }
  [[nodiscard]] bool contains(const Vec3& /*point*/) const { return false; }
  [[nodiscard]] std::optional<Bounds3> bounds() const { return Bounds3{}; }
};

/// The patches of a box: 2 axis + (1 on the high side).
template <class Found>
void cross_box(const Ray& ray, const Vec3& low, const Vec3& high, Found&& found) {
  RaySpan inside;
  int first = 0, last = 0;
  const auto cut = [&](double origin, double slope, double from, double to, int patch) {
    const RaySpan before = inside;
    if (!inside.cut(origin, slope, from, to)) return false;
    if (inside.low > before.low) first = patch + (slope < 0 ? 1 : 0);
    if (inside.high < before.high) last = patch + (slope > 0 ? 1 : 0);
    return true;
  };
  if (!cut(ray.origin.x, ray.direction.x, low.x, high.x, 0)) return;
  if (!cut(ray.origin.y, ray.direction.y, low.y, high.y, 2)) return;
  if (!cut(ray.origin.z, ray.direction.z, low.z, high.z, 4)) return;
  found(inside.low, first);
  found(inside.high, last);
}
inline Vec3 box_normal(int patch) {
  const double sign = patch % 2 == 0 ? -1 : 1;
  return patch < 2 ? Vec3{sign, 0, 0} : patch < 4 ? Vec3{0, sign, 0} : Vec3{0, 0, sign};
}

/// Along the axes of the scene.
struct AlignedBox {
  Vec3 low, high;

  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    cross_box(ray, low, high, found);
  }
  [[nodiscard]] Vec3 normal(const Ray& /*ray*/, double /*t*/, int patch) const { return box_normal(patch); }
  [[nodiscard]] bool contains(const Vec3& point) const { return is_within(point, {low, high}); }
  [[nodiscard]] std::optional<Bounds3> bounds() const { return Bounds3{low, high}; }
};

/// What is placed by an affine map.
struct Placed {
  Transform frame;

  [[nodiscard]] Ray own(const Ray& ray) const {
    return {frame.inverse_point(ray.origin), frame.inverse_direction(ray.direction)};
  }
};

struct PlacedBox : Placed {
  Vec3 low, high;

  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    cross_box(own(ray), low, high, found);
  }
  [[nodiscard]] Vec3 normal(const Ray& /*ray*/, double /*t*/, int patch) const {
    return frame.normal(box_normal(patch));
  }
  [[nodiscard]] bool contains(const Vec3& point) const { return is_within(frame.inverse_point(point), {low, high}); }
  [[nodiscard]] std::optional<Bounds3> bounds() const;
};

/// The ray's point nearest to the centre is found first, so that the discriminant is the difference of two lengths of
/// the ball's size, however far the eye is (Haines et al. 2019, "Precision improvements for ray/sphere intersection").
template <class Found>
void cross_ball(const Vec3& from_centre, const Vec3& direction, double radius, Found&& found) {
  const double a = dot(direction, direction);
  const double middle = -dot(from_centre, direction) / a;
  const Vec3 nearest = from_centre + direction * middle;
  const double discriminant = radius * radius - dot(nearest, nearest);
  if (!(discriminant >= 0)) return;
  const double half = std::sqrt(discriminant / a);
  found(middle - half, 0);
  found(middle + half, 0);
}

struct Ball {
  Vec3 centre;
  double radius;

  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    cross_ball(ray.origin - centre, ray.direction, radius, found);
  }
  [[nodiscard]] Vec3 normal(const Ray& ray, double t, int /*patch*/) const {
    return ray.origin - centre + ray.direction * t;
  }
  [[nodiscard]] bool contains(const Vec3& point) const {
    const Vec3 p = point - centre;
    return dot(p, p) <= radius * radius;
  }
  [[nodiscard]] std::optional<Bounds3> bounds() const {
    const Vec3 half{radius, radius, radius};
    return Bounds3{centre - half, centre + half};
  }
};

/// The image of the unit ball.
struct Ellipsoid : Placed {
  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    const Ray r = own(ray);
    cross_ball(r.origin, r.direction, 1, found);
  }
  [[nodiscard]] Vec3 normal(const Ray& ray, double t, int /*patch*/) const { return frame.normal(own(ray).at(t)); }
  [[nodiscard]] bool contains(const Vec3& point) const {
    const Vec3 p = frame.inverse_point(point);
    return dot(p, p) <= 1;
  }
  [[nodiscard]] std::optional<Bounds3> bounds() const;
};

/// By so much POV-Ray 3.7's cones and cylinders are smaller where it is asked whether a point is in them: a part whose
/// surface coincides with that of a cone is always cut off. Measured with clipped_by of offsets from 1e-16 to 1e-4 and
/// sizes from 0.4 to 50: rho^2 < r^2 - margin with the larger radius as unit, and along the axis the margin counts in
/// distances from the tip to the larger end, or in a cylinder's length. Other shapes: boxes, prisms and balls have
/// none; planes have kPlaneMargin.
inline constexpr double kConeMargin = 1e-10;
/// By so much POV-Ray's planes reach farther, in the scene's units. Measured: between 0.99e-10 and 1.01e-10.
inline constexpr double kPlaneMargin = 1e-10;

/// The patches of a cylinder or cone.
enum ConePatch : int { kConeSide, kConeLowEnd, kConeHighEnd };

/// A solid circular cylinder along the scene's y axis.
struct UprightCylinder {
  double x, z, radius, low, high;

  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    RaySpan inside;
    if (!inside.cut(ray.origin.y, ray.direction.y, low, high)) return;
    int first = ray.direction.y > 0 ? kConeLowEnd : kConeHighEnd;
    int last = ray.direction.y > 0 ? kConeHighEnd : kConeLowEnd;
    const double dx = ray.direction.x, dz = ray.direction.z;
    const double px = ray.origin.x - x, pz = ray.origin.z - z;
    const double a = dx * dx + dz * dz;
    if (a < kSmallestSquare) {
      if (px * px + pz * pz > radius * radius) return;
    } else {
      const double middle = -(px * dx + pz * dz) / a;
      const double nx = px + middle * dx, nz = pz + middle * dz;
      const double discriminant = radius * radius - (nx * nx + nz * nz);
      if (!(discriminant >= 0)) return;
      const double half = std::sqrt(discriminant / a);
      if (middle - half > inside.low) inside.low = middle - half, first = kConeSide;
      if (middle + half < inside.high) inside.high = middle + half, last = kConeSide;
      if (inside.low > inside.high) return;
    }
    found(inside.low, first);
    found(inside.high, last);
  }
  [[nodiscard]] Vec3 normal(const Ray& ray, double t, int patch) const {
    if (patch == kConeSide) {
      return {ray.origin.x - x + ray.direction.x * t, 0, ray.origin.z - z + ray.direction.z * t};
    }
    return {0, patch == kConeLowEnd ? -1.0 : 1.0, 0};
  }
  [[nodiscard]] bool contains(const Vec3& p) const {
    const double along = kConeMargin * (high - low);
    const double px = p.x - x, pz = p.z - z;
    return p.y > low + along && p.y < high - along && px * px + pz * pz < radius * radius * (1 - kConeMargin);
  }
  [[nodiscard]] std::optional<Bounds3> bounds() const {
    return Bounds3{{x - radius, low, z - radius}, {x + radius, high, z + radius}};
  }
};

/// In its frame: from z = 0, where its radius is `small`, to z = 1, where it is 1. small = 1: a cylinder. The small end
/// is at the origin so that everything near the tip of a pointed cone is in proportion to the distance from it.
struct PlacedCone : Placed {
  double small = 1;
  bool open = false;

  [[nodiscard]] double radius(double z) const { return small + (1 - small) * z; }

  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    const Ray far = own(ray);
    const Vec3& d = far.direction;
    const double shift = -dot(far.origin, d) / dot(d, d);
    const Vec3 p = far.at(shift);  // nearest to the small end

    RaySpan inside;
    if (!inside.cut(p.z, d.z, 0, 1)) return;
    const double slope = 1 - small;
    const double a = d.x * d.x + d.y * d.y - slope * slope * d.z * d.z;
    const double b = p.x * d.x + p.y * d.y - slope * d.z * radius(p.z);
    const double c = p.x * p.x + p.y * p.y - radius(p.z) * radius(p.z);
    Roots roots = solve_quadratic(a, b, c);
    if (open) {
      for (const double s : {roots.first, roots.second}) {
        if (roots.count-- > 0 && inside.low <= s && s <= inside.high) found(shift + s, kConeSide);
      }
      return;
    }
    // Within the slab, the points inside the side are those where the quadratic is negative.
    RaySpan side;
    if (roots.count == 0) {
      if (c > 0) return;
      // Inside all along: parallel to the axis of a cylinder. A line inside of both nappes goes through the tip, and
      // only rounding hides its roots.
      if (a < 0) (d.z > 0 ? side.low : side.high) = -b / a;
    } else if (roots.count == 1) {
      (b > 0 ? side.high : side.low) = roots.first;
    } else if (a > 0) {
      side = {roots.first, roots.second};
    } else if (d.z > 0) {
      side.low = roots.second;
    } else {
      side.high = roots.first;
    }
    const bool upwards = d.z > 0;
    const bool enters_by_side = side.low > inside.low, leaves_by_side = side.high < inside.high;
    const double low = std::max(side.low, inside.low), high = std::min(side.high, inside.high);
    if (!(low <= high)) return;
    found(shift + low, enters_by_side ? kConeSide : upwards ? kConeLowEnd : kConeHighEnd);
    found(shift + high, leaves_by_side ? kConeSide : upwards ? kConeHighEnd : kConeLowEnd);
  }
  [[nodiscard]] Vec3 normal(const Ray& ray, double t, int patch) const {
    if (patch != kConeSide) return frame.normal({0, 0, patch == kConeLowEnd ? -1.0 : 1.0});
    const Vec3 p = own(ray).at(t);
    const Vec3 gradient{p.x, p.y, -(1 - small) * radius(p.z)};
    return frame.normal(gradient == Vec3{} ? Vec3{0, 0, -1} : gradient);  // the tip has none: along the axis
  }
  [[nodiscard]] bool contains(const Vec3& point) const {
    const Vec3 p = frame.inverse_point(point);
    const double along = small < 1 ? kConeMargin / (1 - small) : kConeMargin;
    return p.z > along && p.z < 1 - along && p.x * p.x + p.y * p.y < radius(p.z) * radius(p.z) - kConeMargin;
  }
  [[nodiscard]] std::optional<Bounds3> bounds() const;
};

/// Inside is where dot(p - point, direction) < 0.
struct HalfSpace {
  Vec3 point, outward;  ///< outward of length 1

  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    const double approach = dot(outward, ray.direction);
    if (approach != 0) found(dot(outward, point - ray.origin) / approach, 0);
  }
  [[nodiscard]] Vec3 normal(const Ray& /*ray*/, double /*t*/, int /*patch*/) const { return outward; }
  [[nodiscard]] bool contains(const Vec3& p) const { return dot(outward, p - point) < kPlaneMargin; }
  [[nodiscard]] std::optional<Bounds3> bounds() const { return std::nullopt; }
};

/// In its frame: in the plane z = 0, about the origin. For POV-Ray its inside is the half space z < 0.
struct PlacedDisc : Placed {
  double radius_squared, hole_squared;

  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    const Ray r = own(ray);
    if (r.direction.z == 0) return;
    const double t = -r.origin.z / r.direction.z;
    const double x = r.origin.x + r.direction.x * t, y = r.origin.y + r.direction.y * t;
    const double square = x * x + y * y;
    if (hole_squared <= square && square <= radius_squared) found(t, 0);
  }
  [[nodiscard]] Vec3 normal(const Ray& /*ray*/, double /*t*/, int /*patch*/) const { return frame.normal({0, 0, 1}); }
  [[nodiscard]] bool contains(const Vec3& point) const { return frame.inverse_point(point).z <= 0; }
  [[nodiscard]] std::optional<Bounds3> bounds() const;
};

/// For POV-Ray, the inside of a torus that meets itself holds the middle, but the surface in the middle is seen.
struct PlacedTorus : Placed {
  double major_radius, minor_radius;

  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    const Ray r = own(ray);
    const double speed = length(r.direction);
    const Vec3 d = r.direction / speed;
    const double shift = -dot(r.origin, d);
    const TorusCrossings crossings = cross_torus(r.origin + d * shift, d, major_radius, minor_radius);
    for (int i = 0; i < crossings.count; ++i) found((shift + crossings.at[i]) / speed, 0);
  }
  [[nodiscard]] Vec3 normal(const Ray& ray, double t, int patch) const;
  [[nodiscard]] bool contains(const Vec3& point) const {
    const Vec3 p = frame.inverse_point(point);
    const double from_ring = std::hypot(p.x, p.z) - major_radius;
    return from_ring * from_ring + p.y * p.y <= minor_radius * minor_radius;
  }
  [[nodiscard]] std::optional<Bounds3> bounds() const;
};

/// A side of a contour in a plane.
struct ContourEdge {
  double from_x, from_z, to_x, to_z;
};
/// The edges of contours, in rows of equal height along z, so that few of them are looked at. A view's mask has
/// hundreds.
class EdgeRows {
 public:
  EdgeRows() = default;
  explicit EdgeRows(const std::vector<ContourEdge>& edges);

  /// Returns whether a half line from the point crosses an odd number of edges. Each edge holds one of its ends only.
  [[nodiscard]] bool hold(double x, double z) const {
    const double at = (z - low_z_) * rows_per_unit_;
    if (!(at >= 0 && at <= double(first_.size()) - 1)) return false;
    const std::size_t row = std::min(static_cast<std::size_t>(at), first_.size() - 2);
    bool odd = false;
    for (std::size_t i = first_[row]; i < first_[row + 1]; ++i) {
      const ContourEdge& e = edges_[i];
      if ((e.from_z > z) == (e.to_z > z)) continue;
      const double u = (z - e.from_z) / (e.to_z - e.from_z);
      if (x < e.from_x + u * (e.to_x - e.from_x)) odd = !odd;
    }
    return odd;
  }

 private:
  double low_z_ = 0, rows_per_unit_ = 0;
  std::vector<std::size_t> first_;  // of each row, and the end; two at least
  std::vector<ContourEdge> edges_;  // row by row
};

/// In its frame: along y. Patches: the edges' indices, then the low and the high end.
struct PlacedPrism : Placed {
  double low, high;
  bool open;
  std::vector<ContourEdge> edges;
  EdgeRows rows;

  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    const Ray r = own(ray);
    const Vec3 &o = r.origin, &d = r.direction;
    RaySpan inside;
    if (!inside.cut(o.y, d.y, low, high)) return;
    const double square = d.x * d.x + d.z * d.z;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      // The sides on which the two ends lie; an end that edges share has the same for both, so that no ray slips
      // between them.
      const ContourEdge& e = edges[i];
      const double from = d.x * (e.from_z - o.z) - d.z * (e.from_x - o.x);
      const double to = d.x * (e.to_z - o.z) - d.z * (e.to_x - o.x);
      if ((from >= 0) == (to >= 0)) continue;
      const double u = from / (from - to);
      const double x = e.from_x + u * (e.to_x - e.from_x) - o.x, z = e.from_z + u * (e.to_z - e.from_z) - o.z;
      const double t = (x * d.x + z * d.z) / square;
      if (inside.low <= t && t <= inside.high) found(t, static_cast<int>(i));
    }
    if (open || d.y == 0) return;
    for (const int end : {0, 1}) {
      const double t = ((end == 0 ? low : high) - o.y) / d.y;
      if (rows.hold(o.x + d.x * t, o.z + d.z * t)) found(t, static_cast<int>(edges.size()) + end);
    }
  }
  [[nodiscard]] Vec3 normal(const Ray& ray, double t, int patch) const;
  [[nodiscard]] bool contains(const Vec3& point) const {
    const Vec3 p = frame.inverse_point(point);
    return low <= p.y && p.y <= high && rows.hold(p.x, p.z);
  }
  [[nodiscard]] std::optional<Bounds3> bounds() const;
};

/// In its frame: in the plane y = 0. For POV-Ray it has no inside.
struct PlacedPolygon : Placed {
  EdgeRows rows;
  Bounds3 own_bounds;

  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    const Ray r = own(ray);
    if (r.direction.y == 0) return;
    const double t = -r.origin.y / r.direction.y;
    if (rows.hold(r.origin.x + r.direction.x * t, r.origin.z + r.direction.z * t)) found(t, 0);
  }
  [[nodiscard]] Vec3 normal(const Ray& /*ray*/, double /*t*/, int /*patch*/) const { return frame.normal({0, 1, 0}); }
  [[nodiscard]] bool contains(const Vec3& /*point*/) const { return false; }
  [[nodiscard]] std::optional<Bounds3> bounds() const;
};

/// In its frame: squares . p^2 + products . (xy, xz, yz) + linear . p + constant = 0. The frame is about the surface's
/// centre where it has one, and then `linear` is 0.
struct PlacedQuadric : Placed {
  Vec3 squares, products, linear;
  double constant;

  /// Returns half the gradient of the terms of the second degree.
  [[nodiscard]] Vec3 bent(const Vec3& p) const {
    return {squares.x * p.x + (products.x * p.y + products.y * p.z) / 2,
            squares.y * p.y + (products.x * p.x + products.z * p.z) / 2,
            squares.z * p.z + (products.y * p.x + products.z * p.y) / 2};
  }
  [[nodiscard]] double value(const Vec3& p) const { return dot(bent(p) + linear, p) + constant; }

  template <class Found>
  void cross(const Ray& ray, Found&& found) const {
    const Ray far = own(ray);
    const Vec3& d = far.direction;
    const double shift = -dot(far.origin, d) / dot(d, d);
    const Vec3 p = far.at(shift);  // nearest to the centre
    const Vec3 bent_direction = bent(d);
    const Roots roots = solve_quadratic(dot(bent_direction, d), dot(bent_direction, p) + dot(linear, d) / 2, value(p));
    if (roots.count > 0) found(shift + roots.first, 0);
    if (roots.count > 1) found(shift + roots.second, 0);
  }
  [[nodiscard]] Vec3 normal(const Ray& ray, double t, int /*patch*/) const {
    const Vec3 gradient = bent(own(ray).at(t)) * 2 + linear;
    return gradient == Vec3{} ? -ray.direction : frame.normal(gradient);  // the tip of a cone has none
  }
  [[nodiscard]] bool contains(const Vec3& point) const { return value(frame.inverse_point(point)) <= 0; }
  [[nodiscard]] std::optional<Bounds3> bounds() const;
};

using Primitive = std::variant<Nothing, AlignedBox, PlacedBox, Ball, Ellipsoid, UprightCylinder, PlacedCone, HalfSpace,
                               PlacedDisc, PlacedTorus, PlacedPrism, PlacedPolygon, PlacedQuadric>;

/// Calls `visit` with the form that the primitive holds; a switch, which the compiler sees through.
template <class Visit>
decltype(auto) with_form(const Primitive& primitive, Visit&& visit) {
  switch (primitive.index()) {
    case 1:
      return visit(*std::get_if<1>(&primitive));
    case 2:
      return visit(*std::get_if<2>(&primitive));
    case 3:
      return visit(*std::get_if<3>(&primitive));
    case 4:
      return visit(*std::get_if<4>(&primitive));
    case 5:
      return visit(*std::get_if<5>(&primitive));
    case 6:
      return visit(*std::get_if<6>(&primitive));
    case 7:
      return visit(*std::get_if<7>(&primitive));
    case 8:
      return visit(*std::get_if<8>(&primitive));
    case 9:
      return visit(*std::get_if<9>(&primitive));
    case 10:
      return visit(*std::get_if<10>(&primitive));
    case 11:
      return visit(*std::get_if<11>(&primitive));
    case 12:
      return visit(*std::get_if<12>(&primitive));
    default:
      return visit(*std::get_if<0>(&primitive));
  }
}

/// Returns the form in which the shape, which is not a Csg, is traced.
Primitive traced_form(const Shape& shape, const Transform& placed);

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

namespace twocone::sim_povray {
namespace {

/// Relative to a map's largest entry, what rounding leaves of a 0, such as the cosine of 90 degrees.
constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();
/// By so much of its coordinates a bound is larger than what it holds. The crossings that rounding puts beside a
/// surface are nearer to it by orders of magnitude.
constexpr double kBoundMargin = 1e-9;

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

bool is_finite(const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool is_invertible(const Transform& map) {
  const Transform inverse = map.inverse();
  return is_finite(inverse.offset()) && std::ranges::all_of(inverse.rows(), is_finite) && is_finite(map.offset()) &&
         std::ranges::all_of(map.rows(), is_finite);
}

/// Returns the scene's axis as seen from the frame: the dot product with it is the image's coordinate without offset.
Vec3 seen_axis(const Transform& frame, std::size_t axis) {
  const auto& rows = frame.rows();
  return {component(rows[0], axis), component(rows[1], axis), component(rows[2], axis)};
}

/// Returns the box about a point that reaches `reach(axis seen from the frame)` to both sides.
template <class Reach>
Bounds3 about(const Vec3& centre, const Transform& frame, Reach reach) {
  const Vec3 half{reach(seen_axis(frame, 0)), reach(seen_axis(frame, 1)), reach(seen_axis(frame, 2))};
  return {centre - half, centre + half};
}

Bounds3 image_of_box(const Transform& frame, const Vec3& low, const Vec3& high) {
  const Vec3 half = (high - low) / 2;
  return about(frame.point((low + high) / 2), frame, [&](const Vec3& axis) {
    return std::abs(axis.x) * half.x + std::abs(axis.y) * half.y + std::abs(axis.z) * half.z;
  });
}

Bounds3 overlap(const Bounds3& a, const Bounds3& b) { return {highest(a.low, b.low), lowest(a.high, b.high)}; }
bool is_empty(const Bounds3& b) { return !(b.low.x <= b.high.x && b.low.y <= b.high.y && b.low.z <= b.high.z); }

Bounds3 enlarged(const Bounds3& b) {
  const Vec3 far = highest(highest(b.low, -b.low), highest(b.high, -b.high));
  const double margin = kBoundMargin * std::max({far.x, far.y, far.z});
  const Vec3 by{margin, margin, margin};
  return {b.low - by, b.high + by};
}

/// Returns the box around the edges, at y = 0.
Bounds3 around_edges(const std::vector<ContourEdge>& edges) {
  Bounds3 bounds{{kInfinity, 0, kInfinity}, {-kInfinity, 0, -kInfinity}};
  for (const ContourEdge& e : edges) {
    const Vec3 from{e.from_x, 0, e.from_z}, to{e.to_x, 0, e.to_z};
    bounds = around(bounds, {lowest(from, to), highest(from, to)});
  }
  return bounds;
}

std::vector<ContourEdge> edges_of(const std::vector<Contour>& contours) {
  std::vector<ContourEdge> edges;
  for (const Contour& contour : contours) {
    for (std::size_t i = 1; i < contour.size(); ++i) {
      const auto& [from_x, from_z] = contour[i - 1];
      const auto& [to_x, to_z] = contour[i];
      if (contour[i] != contour[i - 1]) edges.push_back({from_x, from_z, to_x, to_z});
    }
  }
  return edges;
}

/// Returns two directions of length 1 at right angles to `axis`, which has length 1, and to each other.
std::pair<Vec3, Vec3> across(const Vec3& axis) {
  const double x = std::abs(axis.x), y = std::abs(axis.y), z = std::abs(axis.z);
  const Vec3 least = x <= y && x <= z ? Vec3{1, 0, 0} : y <= z ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
  const Vec3 u = normalized(cross(axis, least));
  return {u, cross(axis, u)};
}

/// Returns whether the map leads the axes to axes.
bool keeps_axes(const Transform& map) {
  return std::ranges::all_of(map.rows(), [](const Vec3& row) {
    const double x = std::abs(row.x), y = std::abs(row.y), z = std::abs(row.z);
    const double limit = kRounding * std::max({x, y, z});
    return int(x > limit) + int(y > limit) + int(z > limit) == 1;
  });
}

/// Returns whether the map leads circles in the plane of `u` and `v` to circles; both have length 1, at right angles.
bool keeps_circles(const Transform& map, const Vec3& u, const Vec3& v) {
  const Vec3 image_u = map.direction(u), image_v = map.direction(v);
  const double square = dot(image_u, image_u);
  return std::abs(dot(image_v, image_v) - square) <= kRounding * square &&
         std::abs(dot(image_u, image_v)) <= kRounding * square;
}
bool keeps_shape(const Transform& map) {
  const Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  return keeps_circles(map, x, y) && keeps_circles(map, y, z) && keeps_circles(map, z, x);
}

Primitive traced_box(const Box& box, const Transform& placed) {
  const Vec3 low = lowest(box.low, box.high), high = highest(box.low, box.high);
  if (!keeps_axes(placed)) return PlacedBox{{placed}, low, high};
  const Vec3 a = placed.point(low), b = placed.point(high);
  return AlignedBox{lowest(a, b), highest(a, b)};
}

Primitive traced_sphere(const Sphere& sphere, const Transform& placed) {
  const double radius = std::abs(sphere.radius);
  if (radius == 0) return Nothing{};
  if (keeps_shape(placed)) return Ball{placed.point(sphere.centre), radius * length(placed.rows()[0])};
  return Ellipsoid{
      {Transform::scaling({radius, radius, radius}).then(Transform::translation(sphere.centre)).then(placed)}};
}

/// Returns the cylinder along the scene's y axis if it is one.
std::optional<Primitive> traced_upright(const Cone& cylinder, const Transform& placed) {
  const Vec3 axis = cylinder.cap - cylinder.base;
  const Vec3 image = placed.direction(axis);
  const double limit = kRounding * std::abs(image.y);
  if (!(std::abs(image.x) <= limit && std::abs(image.z) <= limit)) return std::nullopt;
  const auto [u, v] = across(normalized(axis));
  const Vec3 image_u = placed.direction(u);
  const bool flat = std::max(std::abs(image_u.y), std::abs(placed.direction(v).y)) <= kRounding * length(image_u);
  if (!flat || !keeps_circles(placed, u, v)) return std::nullopt;
  const Vec3 base = placed.point(cylinder.base);
  const double end = placed.point(cylinder.cap).y;
  return UprightCylinder{base.x, base.z, std::abs(cylinder.base_radius) * length(image_u), std::min(base.y, end),
                         std::max(base.y, end)};
}

Primitive traced_cone(Cone cone, const Transform& placed) {
  cone.base_radius = std::abs(cone.base_radius);
  cone.cap_radius = std::abs(cone.cap_radius);
  if (cone.cap == cone.base || std::max(cone.base_radius, cone.cap_radius) == 0) return Nothing{};
  if (cone.base_radius == cone.cap_radius && !cone.open) {
    if (auto upright = traced_upright(cone, placed)) return *std::move(upright);
  }
  if (cone.base_radius > cone.cap_radius) {
    std::swap(cone.base, cone.cap);
    std::swap(cone.base_radius, cone.cap_radius);
  }
  const Vec3 axis = cone.cap - cone.base;
  const auto [u, v] = across(normalized(axis));
  const auto frame = Transform::matrix({u * cone.cap_radius, v * cone.cap_radius, axis}, cone.base);
  if (!frame) return Nothing{};
  return PlacedCone{{frame->then(placed)}, cone.base_radius / cone.cap_radius, cone.open};
}

Primitive traced_plane(const Plane& plane, const Transform& placed) {
  const double size = length(plane.normal);
  if (size == 0) return Nothing{};
  const Vec3 normal = plane.normal / size;
  return HalfSpace{placed.point(normal * plane.distance), normalized(placed.normal(normal))};
}

Primitive traced_disc(const FlatDisc& disc, const Transform& placed) {
  const double size = length(disc.normal);
  if (size == 0) return Nothing{};
  const Vec3 normal = disc.normal / size;
  const auto [u, v] = across(normal);
  const auto frame = Transform::matrix({u, v, normal}, disc.centre);
  if (!frame) return Nothing{};
  return PlacedDisc{{frame->then(placed)}, disc.radius * disc.radius, disc.hole_radius * disc.hole_radius};
}

Primitive traced_polygon(const Polygon& polygon, const Transform& placed) {
  // The contours' plane z = 0 becomes the plane y = 0 of the frame.
  const auto exchange = Transform::matrix({Vec3{1, 0, 0}, Vec3{0, 0, 1}, Vec3{0, 1, 0}}, {});
  std::vector<ContourEdge> edges = edges_of(polygon.contours);
  if (edges.empty()) return Nothing{};
  return PlacedPolygon{{exchange->then(placed)}, EdgeRows(edges), around_edges(edges)};
}

Primitive traced_prism(const Prism& prism, const Transform& placed) {
  std::vector<ContourEdge> edges = edges_of(prism.contours);
  if (edges.empty()) return Nothing{};
  EdgeRows rows(edges);
  return PlacedPrism{
      {placed},       std::min(prism.low, prism.high), std::max(prism.low, prism.high), prism.open, std::move(edges),
      std::move(rows)};
}

/// Returns the symmetric matrix whose product with p is PlacedQuadric::bent(p).
std::array<Vec3, 3> matrix_of(const Vec3& squares, const Vec3& products) {
  const Vec3 half = products / 2;
  return {Vec3{squares.x, half.x, half.y}, Vec3{half.x, squares.y, half.z}, Vec3{half.y, half.z, squares.z}};
}

Primitive traced_quadric(const Quadric& quadric, const Transform& placed) {
  PlacedQuadric form{{placed}, quadric.squares, quadric.products, quadric.linear, quadric.constant};
  // Without mixed terms each axis has a centre of its own, or none: the axis of a cylinder or of a paraboloid is found
  // too.
  Vec3 centre{};
  if (quadric.products == Vec3{}) {
    const auto move = [](double square, double& linear, double& at) {
      if (square == 0) return;
      at = -linear / (2 * square);
      linear = 0;
    };
    move(quadric.squares.x, form.linear.x, centre.x);
    move(quadric.squares.y, form.linear.y, centre.y);
    move(quadric.squares.z, form.linear.z, centre.z);
  } else {
    const auto rows = matrix_of(quadric.squares, quadric.products);
    const double size = length(rows[0]) * length(rows[1]) * length(rows[2]);
    constexpr double kSingular = 1e-12;
    const auto solver = Transform::matrix(rows, {});
    if (!solver || std::abs(dot(rows[0], cross(rows[1], rows[2]))) <= kSingular * size) return form;
    centre = solver->inverse_direction(quadric.linear / -2);
    form.linear = {};
  }
  form.constant = PlacedQuadric{{}, quadric.squares, quadric.products, quadric.linear, quadric.constant}.value(centre);
  form.frame = Transform::translation(centre).then(placed);
  return form;
}

/// Returns whether x M x > 0 for all x but 0.
bool is_positive(const std::array<Vec3, 3>& m) {
  return m[0].x > 0 && m[0].x * m[1].y - m[0].y * m[1].x > 0 && dot(m[0], cross(m[1], m[2])) > 0;
}

/// Returns whether what is beside the edge at (x, z), towards greater x, or greater z if `along_z`, is inside.
bool is_inside_beyond(const std::vector<ContourEdge>& edges, std::size_t index, double x, double z, bool along_z) {
  bool odd = false;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (i == index) continue;
    ContourEdge e = edges[i];
    if (along_z) e = {e.from_z, e.from_x, e.to_z, e.to_x};
    const double along = along_z ? z : x, level = along_z ? x : z;
    if ((e.from_z > level) == (e.to_z > level)) continue;
    const double u = (level - e.from_z) / (e.to_z - e.from_z);
    if (along < e.from_x + u * (e.to_x - e.from_x)) odd = !odd;
  }
  return odd;
}

bool is_strictly_within(const Bounds3& inner, const Bounds3& outer) {
  return outer.low.x < inner.low.x && outer.low.y < inner.low.y && outer.low.z < inner.low.z &&
         inner.high.x < outer.high.x && inner.high.y < outer.high.y && inner.high.z < outer.high.z;
}

/// Returns whether corners of the box are on both sides of the plane.
bool divides(const HalfSpace& plane, const Bounds3& box) {
  const Vec3 middle = (box.low + box.high) / 2;
  const Vec3 half = (box.high - box.low) / 2;
  const double reach =
      std::abs(plane.outward.x) * half.x + std::abs(plane.outward.y) * half.y + std::abs(plane.outward.z) * half.z;
  return std::abs(dot(plane.outward, middle - plane.point)) <= reach + kPlaneMargin;
}

/// Returns the bounds of what a primitive contains, which is not always near to its surface.
std::optional<Bounds3> bounds_of_inside(const Primitive& primitive) {
  return with_form(primitive, [](const auto& form) -> std::optional<Bounds3> {
    using Form = std::decay_t<decltype(form)>;
    if constexpr (std::is_same_v<Form, PlacedDisc>) return std::nullopt;
    if constexpr (std::is_same_v<Form, PlacedQuadric>) {
      if (!is_positive(matrix_of(form.squares, form.products))) return std::nullopt;
    }
    const auto bounds = form.bounds();
    return bounds ? std::optional(enlarged(*bounds)) : std::nullopt;
  });
}

}  // namespace

EdgeRows::EdgeRows(const std::vector<ContourEdge>& edges) {
  const Bounds3 bounds = around_edges(edges);
  const double height = bounds.high.z - bounds.low.z;
  const std::size_t count = std::min<std::size_t>(edges.size(), 256);
  first_.assign(2, 0);
  if (!(height > 0)) return;
  low_z_ = bounds.low.z;
  rows_per_unit_ = double(count) / height;
  first_.assign(1, 0);
  for (std::size_t row = 0; row < count; ++row) {
    for (const ContourEdge& e : edges) {
      // One row more on both sides, because of rounding.
      const double low = (std::min(e.from_z, e.to_z) - low_z_) * rows_per_unit_ - 1;
      const double high = (std::max(e.from_z, e.to_z) - low_z_) * rows_per_unit_ + 1;
      if (low <= double(row) && double(row) <= high) edges_.push_back(e);
    }
    first_.push_back(edges_.size());
  }
}

std::optional<Bounds3> PlacedBox::bounds() const { return image_of_box(frame, low, high); }

std::optional<Bounds3> Ellipsoid::bounds() const {
  return about(frame.offset(), frame, [](const Vec3& axis) { return length(axis); });
}

std::optional<Bounds3> PlacedCone::bounds() const {
  const auto end = [&](double z) {
    return about(frame.point({0, 0, z}), frame,
                 [&](const Vec3& axis) { return radius(z) * std::hypot(axis.x, axis.y); });
  };
  return around(end(0), end(1));
}

std::optional<Bounds3> PlacedDisc::bounds() const {
  const double radius = std::sqrt(radius_squared);
  return about(frame.offset(), frame, [&](const Vec3& axis) { return radius * std::hypot(axis.x, axis.y); });
}

Vec3 PlacedTorus::normal(const Ray& ray, double t, int /*patch*/) const {
  const Vec3 p = own(ray).at(t);
  const double rho = std::hypot(p.x, p.z);
  if (rho == 0) return frame.normal({0, p.y, 0});
  // Where a torus meets itself, a point may be on the part of the tube that comes from the other side of the axis.
  const auto off_tube = [&](double from_ring) {
    return std::abs(from_ring * from_ring + p.y * p.y - minor_radius * minor_radius);
  };
  const bool beyond_axis = off_tube(rho + major_radius) < off_tube(rho - major_radius);
  const double share = 1 + (beyond_axis ? major_radius : -major_radius) / rho;
  return frame.normal({p.x * share, p.y, p.z * share});
}

std::optional<Bounds3> PlacedTorus::bounds() const {
  return about(frame.offset(), frame, [&](const Vec3& axis) {
    return std::abs(major_radius) * std::hypot(axis.x, axis.z) + std::abs(minor_radius) * length(axis);
  });
}

Vec3 PlacedPrism::normal(const Ray& ray, double t, int patch) const {
  const auto index = static_cast<std::size_t>(patch);
  if (index >= edges.size()) return frame.normal({0, index == edges.size() ? -1.0 : 1.0, 0});
  const ContourEdge& e = edges[index];
  const Vec3 p = own(ray).at(t);
  const Vec3 normal{e.to_z - e.from_z, 0, e.from_x - e.to_x};
  const bool along_z = std::abs(normal.z) > std::abs(normal.x);
  const bool towards_greater = (along_z ? normal.z : normal.x) > 0;
  return frame.normal(towards_greater == is_inside_beyond(edges, index, p.x, p.z, along_z) ? -normal : normal);
}

std::optional<Bounds3> PlacedPrism::bounds() const {
  Bounds3 own_bounds = around_edges(edges);
  own_bounds.low.y = low;
  own_bounds.high.y = high;
  return image_of_box(frame, own_bounds.low, own_bounds.high);
}

std::optional<Bounds3> PlacedPolygon::bounds() const { return image_of_box(frame, own_bounds.low, own_bounds.high); }

std::optional<Bounds3> PlacedQuadric::bounds() const {
  if (linear != Vec3{}) return std::nullopt;
  const double sign = constant <= 0 ? 1 : -1;
  const auto rows = matrix_of(squares * sign, products * sign);
  if (!is_positive(rows)) return std::nullopt;
  const auto solver = Transform::matrix(rows, {});
  if (!solver) return std::nullopt;
  // The point of an ellipsoid that is farthest along an axis g is in the direction M^-1 g.
  return about(frame.offset(), frame, [&](const Vec3& axis) {
    return std::sqrt(std::max(0.0, -sign * constant * dot(axis, solver->inverse_direction(axis))));
  });
}

Primitive traced_form(const Shape& shape, const Transform& placed) {
  if (!is_invertible(placed)) return Nothing{};
  return std::visit(Overloaded{[&](const Box& box) { return traced_box(box, placed); },
                               [&](const Sphere& sphere) { return traced_sphere(sphere, placed); },
                               [&](const Cone& cone) { return traced_cone(cone, placed); },
                               [&](const FlatDisc& disc) { return traced_disc(disc, placed); },
                               [&](const Plane& plane) { return traced_plane(plane, placed); },
                               [&](const Torus& torus) -> Primitive {
                                 return PlacedTorus{{placed}, torus.major_radius, torus.minor_radius};
                               },
                               [&](const Prism& prism) { return traced_prism(prism, placed); },
                               [&](const Quadric& quadric) { return traced_quadric(quadric, placed); },
                               [&](const Polygon& polygon) { return traced_polygon(polygon, placed); },
                               [&](const Csg& /*csg*/) -> Primitive { return Nothing{}; }},
                    shape);
}

TracedSolid::TracedSolid(const Object& object) : root_(add_node(object)) {
  add_surfaces({root_, false}, nullptr, {});
  bounds_ = bounds_of_surfaces();
}

std::size_t TracedSolid::add_node(const Object& object) {
  Node node{.object = &object, .primitive = 0, .inverse = object.inverse};
  if (const auto* csg = std::get_if<Csg>(&object.shape)) {
    const bool difference = csg->combination == Combination::kDifference;
    node.all = difference || csg->combination == Combination::kIntersection;
    for (const Object& part : csg->parts) node.sides.push_back({add_node(part), difference && !node.sides.empty()});
  }
  if (node.sides.empty()) {
    node.primitive = primitives_.size();
    primitives_.push_back(traced_form(object.shape, object.placed));
  }
  for (const Object& clip : object.clipped_by) node.clips.push_back({add_node(clip), false});
  nodes_.push_back(std::move(node));
  return nodes_.size() - 1;
}

void TracedSolid::add_surfaces(const Side& side, const Texture* texture, std::vector<Side> conditions) {
  const Node& node = nodes_[side.node];
  const Object& object = *node.object;
  const bool inverted = side.inverted != node.inverse;
  if (object.texture != nullptr) texture = object.texture.get();
  conditions.insert(conditions.end(), node.clips.begin(), node.clips.end());
  if (node.sides.empty()) {
    const std::size_t begin = conditions_.size();
    conditions_.insert(conditions_.end(), conditions.begin(), conditions.end());
    surfaces_.push_back({node.primitive, {begin, conditions_.size()}, texture, inverted});
    return;
  }
  // The outside of a union is what is outside of all parts, and so on: where not all sides count, any does.
  const bool all = node.all != inverted;
  const bool sees_all = !node.all && std::get<Csg>(object.shape).combination == Combination::kUnion && !inverted;
  for (std::size_t i = 0; i < node.sides.size(); ++i) {
    std::vector<Side> of_part = conditions;
    for (std::size_t j = 0; j < node.sides.size() && !sees_all; ++j) {
      const Side& other = node.sides[j];
      if (j != i) of_part.push_back({other.node, (other.inverted != inverted) == all});
    }
    add_surfaces({node.sides[i].node, node.sides[i].inverted != inverted}, texture, std::move(of_part));
  }
}

bool TracedSolid::is_inside(std::size_t index, const Vec3& point) const {
  const Node& node = nodes_[index];
  const auto holds = [&](const Side& side) { return is_inside(side.node, point) != side.inverted; };
  bool inside;
  if (node.sides.empty()) {
    inside = with_form(primitives_[node.primitive], [&](const auto& form) { return form.contains(point); });
  } else {
    inside = node.all ? std::ranges::all_of(node.sides, holds) : std::ranges::any_of(node.sides, holds);
  }
  return inside != node.inverse && std::ranges::all_of(node.clips, holds);
}

bool TracedSolid::is_seen(const Surface& surface, const Vec3& point) const {
  for (std::size_t i = surface.conditions.begin; i < surface.conditions.end; ++i) {
    const Side& side = conditions_[i];
    if (is_inside(side.node, point) == side.inverted) return false;
  }
  return true;
}

bool TracedSolid::contains(const Vec3& point) const { return is_inside(root_, point); }

bool TracedSolid::nearest(const Ray& ray, double t_min, double t_max, Crossing& found) const {
  const Surface* best = nullptr;
  Vec3 normal;
  const bool all_seen = is_single();
  for (const Surface& surface : surfaces_) {
    with_form(primitives_[surface.primitive], [&](const auto& form) {
      bool nearer = false;
      int patch_there = 0;
      form.cross(ray, [&](double t, int patch) {
        if (!(t > t_min && t < t_max) || !(all_seen || is_seen(surface, ray.at(t)))) return;
        nearer = true;
        t_max = t;
        patch_there = patch;
      });
      if (!nearer) return;
      best = &surface;
      normal = form.normal(ray, t_max, patch_there);
    });
  }
  if (best == nullptr) return false;
  if (best->inverted) normal = -normal;
  found = {t_max, normal, best->texture, dot(normal, ray.direction) < 0};
  return true;
}

bool TracedSolid::blocks(const Ray& ray, double t_min, double t_max) const {
  const bool all_seen = is_single();
  for (const Surface& surface : surfaces_) {
    const bool blocked = with_form(primitives_[surface.primitive], [&](const auto& form) {
      bool any = false;
      form.cross(ray, [&](double t, int /*patch*/) {
        any = any || (t > t_min && t < t_max && (all_seen || is_seen(surface, ray.at(t))));
      });
      return any;
    });
    if (blocked) return true;
  }
  return false;
}

bool TracedSolid::may_cross(const Bounds3& box) const {
  return std::ranges::any_of(surfaces_, [&](const Surface& surface) {
    const Primitive& primitive = primitives_[surface.primitive];
    if (const auto* plane = std::get_if<HalfSpace>(&primitive)) return divides(*plane, box);
    const auto bounds = with_form(primitive, [](const auto& form) { return form.bounds(); });
    if (!bounds) return true;
    // A box's surface is not within it.
    const bool is_within = std::holds_alternative<AlignedBox>(primitive) && is_strictly_within(box, *bounds);
    return !is_within && !is_empty(overlap(enlarged(*bounds), box));
  });
}

std::optional<Bounds3> TracedSolid::as_box() const {
  if (!is_single() || surfaces_.front().inverted) return std::nullopt;
  const auto* box = std::get_if<AlignedBox>(&primitives_[surfaces_.front().primitive]);
  return box != nullptr ? box->bounds() : std::nullopt;
}

std::optional<Bounds3> TracedSolid::bounds_of(const Side& side) const {
  const Node& node = nodes_[side.node];
  if (side.inverted) return std::nullopt;
  std::optional<Bounds3> result;
  const auto keep = [&](const std::optional<Bounds3>& bounds) {
    if (bounds) result = result ? overlap(*result, *bounds) : *bounds;
  };
  if (!node.inverse) {
    if (node.sides.empty()) {
      result = bounds_of_inside(primitives_[node.primitive]);
    } else if (node.all) {
      for (const Side& part : node.sides) keep(bounds_of(part));
    } else {
      result = bounds_of(node.sides.front());
      for (const Side& part : node.sides) {
        const auto bounds = bounds_of(part);
        if (result) result = bounds ? std::optional(around(*result, *bounds)) : std::nullopt;
      }
    }
  }
  for (const Side& clip : node.clips) keep(bounds_of(clip));
  return result;
}

std::optional<Bounds3> TracedSolid::bounds_of_surfaces() const {
  std::optional<Bounds3> result;
  for (const Surface& surface : surfaces_) {
    const Primitive& primitive = primitives_[surface.primitive];
    if (std::holds_alternative<Nothing>(primitive)) continue;
    std::optional<Bounds3> seen = with_form(primitive, [](const auto& form) { return form.bounds(); });
    if (seen) seen = enlarged(*seen);
    for (std::size_t i = surface.conditions.begin; i < surface.conditions.end; ++i) {
      const auto bounds = bounds_of(conditions_[i]);
      if (bounds) seen = seen ? overlap(*seen, *bounds) : *bounds;
    }
    if (!seen) return std::nullopt;
    if (!is_empty(*seen)) result = result ? around(*result, *seen) : *seen;
  }
  return result ? result : Bounds3{};
}

}  // namespace twocone::sim_povray

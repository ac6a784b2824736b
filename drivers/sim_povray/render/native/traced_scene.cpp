// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/traced_scene.h"

#include <algorithm>
#include <utility>

#include "drivers/sim_povray/render/native/pigment_colour.h"
#include "drivers/sim_povray/scene/evaluator.h"

namespace twocone::sim_povray {

namespace {

/// Returns POV-Ray's keyword for a shape.
const char* kind_of(const Shape& shape) {
  struct Kind {
    const char* operator()(const Box& /*shape*/) const { return "box"; }
    const char* operator()(const Sphere& /*shape*/) const { return "sphere"; }
    const char* operator()(const Cone& cone) const { return cone.base_radius == cone.cap_radius ? "cylinder" : "cone"; }
    const char* operator()(const FlatDisc& /*shape*/) const { return "disc"; }
    const char* operator()(const Plane& /*shape*/) const { return "plane"; }
    const char* operator()(const Torus& /*shape*/) const { return "torus"; }
    const char* operator()(const Prism& /*shape*/) const { return "prism"; }
    const char* operator()(const Quadric& /*shape*/) const { return "quadric"; }
    const char* operator()(const Polygon& /*shape*/) const { return "polygon"; }
    const char* operator()(const Csg& csg) const {
      switch (csg.combination) {
        case Combination::kUnion:
          return "union";
        case Combination::kMerge:
          return "merge";
        case Combination::kIntersection:
          return "intersection";
        case Combination::kDifference:
          break;
      }
      return "difference";
    }
  };
  return std::visit(Kind{}, shape);
}

}  // namespace

const Transform& Poses::of(int mover) const {
  static const Transform kStill;
  if (mover == kViewMover) return view;
  return mover < 0 ? kStill : movers.at(std::size_t(mover));
}

TracedScene::TracedScene(EvaluatedScene scene) : scene_(std::move(scene)) {
  for (const Object& object : scene_.objects) add(object, object.mover);
  for (Group& group : groups_) {
    std::vector<Bounds3> seen;
    std::vector<Bounds3> shadows;
    for (int i = 0; i < int(group.items.size()); ++i) {
      const Item& item = group.items[std::size_t(i)];
      const auto bounds = item.solid.bounds();
      (bounds ? group.bounded_items : group.unbounded).push_back(i);
      if (bounds) seen.push_back(*bounds);
      if (!item.casts_shadow) continue;
      (bounds ? group.shadow_items : group.unbounded_shadows).push_back(i);
      if (bounds) shadows.push_back(*bounds);
    }
    group.bounded = Bvh(seen);
    group.shadows = Bvh(shadows);
  }
}

void TracedScene::add(const Object& object, int mover) {
  const auto* csg = std::get_if<Csg>(&object.shape);
  if (csg != nullptr && csg->combination == Combination::kUnion && !object.inverse && object.clipped_by.empty()) {
    for (Object part : csg->parts) {
      if (part.texture == nullptr) part.texture = object.texture;
      if (part.name.empty()) part.name = object.name;
      part.no_shadow = part.no_shadow || object.no_shadow;
      part.no_image = part.no_image || object.no_image;
      part.no_reflection = part.no_reflection || object.no_reflection;
      add(part, mover);
    }
    return;
  }
  auto group = std::find_if(groups_.begin(), groups_.end(), [&](const Group& g) { return g.mover == mover; });
  if (group == groups_.end()) group = groups_.insert(groups_.end(), Group{.mover = mover});
  TracedSolid solid(object);
  const auto bounds = solid.bounds();
  const auto box = solid.as_box();
  const int number = int(places_.size());
  places_.push_back({int(group - groups_.begin()), int(group->items.size())});
  sources_.push_back({object.is_bound ? "shape" : kind_of(object.shape), object.name, object.file, object.line});
  const Texture* box_texture = solid.only_texture() != nullptr ? solid.only_texture() : object.texture.get();
  group->items.push_back({std::move(solid), object.texture.get(), number, !object.no_shadow, !object.no_image,
                          !object.no_reflection, box.value_or(bounds.value_or(Bounds3{})), box.has_value(),
                          box_texture});
}

Bounds3 moved(const Bounds3& box, const Transform& by) {
  Bounds3 result{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p = by.point({(corner & 1) != 0 ? box.high.x : box.low.x, (corner & 2) != 0 ? box.high.y : box.low.y,
                             (corner & 4) != 0 ? box.high.z : box.low.z});
    result = around(result, {p, p});
  }
  return result;
}

PosedScene::PosedScene(const TracedScene& scene, Poses poses) : scene_(scene), poses_(std::move(poses)) {
  for (const TracedScene::Group& group : scene.groups()) {
    const Transform& pose = poses_.of(group.mover);
    const auto bounds = [&](const Bvh& bvh, bool is_infinite) -> std::optional<Bounds3> {
      if (is_infinite) return std::nullopt;
      if (bvh.empty()) return Bounds3{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
      // Rounding of the corners must not lose what a ray only touches.
      constexpr double kSlack = 1e-9;
      Bounds3 box = moved(bvh.nodes().front().bounds, pose);
      const double most = std::max(length(box.low), length(box.high));
      const Vec3 margin = Vec3{1, 1, 1} * (kSlack * most);
      return Bounds3{box.low - margin, box.high + margin};
    };
    groups_.push_back({pose.inverse(), bounds(group.bounded, !group.unbounded.empty()),
                       bounds(group.shadows, !group.unbounded_shadows.empty())});
  }
  for (const LightSource& given : scene.scene().lights) {
    LightSource light = given;
    light.position = poses_.of(light.mover).point(given.position);
    light.point_at = poses_.of(light.mover).point(given.point_at);
    lights_.push_back(light);
  }
}

std::optional<Meeting> nearest(const TracedScene& scene, const Poses& poses, const Ray& ray, RayKind kind,
                               GroupSet which, double t_max) {
  Meeting best{.t = t_max};
  int best_number = 0;
  const std::vector<TracedScene::Group>& groups = scene.groups();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (g < kGroupBits && (which >> g & 1) == 0) continue;
    const TracedScene::Group& group = groups[g];
    const Transform& pose = poses.of(group.mover);
    const Ray local =
        group.mover == -1 ? ray : Ray{pose.inverse_point(ray.origin), pose.inverse_direction(ray.direction)};
    const auto visit = [&](int index) {
      const TracedScene::Item& item = group.items[std::size_t(index)];
      if (!(kind == RayKind::kFromCamera ? item.in_image : item.in_reflection)) return false;
      Crossing found;
      // What lies at the same distance is found too, because the first of the scene counts.
      const double farthest = best.group == nullptr ? t_max : std::nextafter(best.t, kInfinity);
      if (!item.solid.nearest(local, kNearest, farthest, found)) return false;
      if (found.t == best.t && item.number > best_number) return false;
      best.t = found.t;
      best_number = item.number;
      best.group = &group;
      best.texture = found.texture != nullptr ? found.texture : item.texture;
      best.normal = found.normal;
      best.pattern_point = local.origin + local.direction * found.t;
      return false;
    };
    for (const int index : group.unbounded) visit(index);
    group.bounded.search(local, kNearest, best.t, [&](int i) { return visit(group.bounded_items[std::size_t(i)]); });
  }
  if (best.group == nullptr) return std::nullopt;
  best.point = ray.origin + ray.direction * best.t;
  if (best.group->mover != -1) best.normal = poses.of(best.group->mover).normal(best.normal);
  best.normal = normalized(best.normal);
  best.number = best_number;
  return best;
}

Colour sky_colour(const EvaluatedScene& scene, const Vec3& direction) {
  return scene.sky ? pigment_colour(*scene.sky, direction) : scene.background;
}

}  // namespace twocone::sim_povray

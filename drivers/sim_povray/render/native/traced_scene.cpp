// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/traced_scene.h"

#include <algorithm>
#include <utility>

#include "drivers/sim_povray/render/native/pigment_colour.h"
#include "drivers/sim_povray/render/native/shading.h"
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
  sources_.push_back({kind_of(object.shape), object.name, object.file, object.line});
  const Texture* box_texture = solid.only_texture() != nullptr ? solid.only_texture() : object.texture.get();
  group->items.push_back({std::move(solid), object.texture.get(), number, !object.no_shadow, !object.no_image,
                          !object.no_reflection, box.value_or(bounds.value_or(Bounds3{})), box.has_value(),
                          box_texture});
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

bool is_shadowed(const TracedScene& scene, const Poses& poses, const Vec3& point, const Vec3& light) {
  const double distance = length(light - point);
  const double farthest = distance - kNearestShadow;
  const Ray ray{point, (light - point) / distance};
  for (const TracedScene::Group& group : scene.groups()) {
    const Transform& pose = poses.of(group.mover);
    const Ray local =
        group.mover == -1 ? ray : Ray{pose.inverse_point(ray.origin), pose.inverse_direction(ray.direction)};
    bool blocked = false;
    const auto visit = [&](int index) {
      return blocked = group.items[std::size_t(index)].solid.blocks(local, kNearestShadow, farthest);
    };
    for (const int index : group.unbounded_shadows) {
      if (visit(index)) return true;
    }
    group.shadows.search(local, kNearestShadow, farthest,
                         [&](int i) { return visit(group.shadow_items[std::size_t(i)]); });
    if (blocked) return true;
  }
  return false;
}

Colour traced(const TracedScene& scene, const Poses& poses, const Ray& ray, RayKind kind, int level, double weight) {
  const EvaluatedScene& description = scene.scene();
  if (level > description.max_trace_level || weight < description.adc_bailout) return {};
  const auto meeting = nearest(scene, poses, ray, kind);
  if (meeting) return shaded(scene, poses, ray, *meeting, level, weight);
  return sky_colour(description, ray.direction);
}

Colour sky_colour(const EvaluatedScene& scene, const Vec3& direction) {
  return scene.sky ? pigment_colour(*scene.sky, direction) : scene.background;
}

Meeting meeting_at(const Poses& poses, const Ray& ray, const TracedScene::Group& group, const TracedScene::Item& item,
                   const Crossing& crossing) {
  const Texture* const texture = crossing.texture != nullptr ? crossing.texture : item.texture;
  const Vec3 point = ray.at(crossing.t);
  if (group.mover == -1) return {crossing.t, &group, texture, point, point, normalized(crossing.normal), item.number};
  const Transform& pose = poses.of(group.mover);
  return {crossing.t, &group, texture, point, pose.inverse_point(point), normalized(pose.normal(crossing.normal)),
          item.number};
}

std::optional<Meeting> meeting_with(const Poses& poses, const Ray& ray, const TracedScene::Group& group,
                                    const TracedScene::Item& item) {
  const Transform& pose = poses.of(group.mover);
  const Ray local =
      group.mover == -1 ? ray : Ray{pose.inverse_point(ray.origin), pose.inverse_direction(ray.direction)};
  Crossing found;
  if (!item.solid.nearest(local, kNearest, kInfinity, found)) return std::nullopt;
  return meeting_at(poses, ray, group, item, found);
}

LightSource placed(const LightSource& light, const Poses& poses) {
  LightSource result = light;
  if (light.mover == -1) return result;
  result.position = poses.of(light.mover).point(light.position);
  result.point_at = poses.of(light.mover).point(light.point_at);
  return result;
}

Colour light_of(const Meeting& meeting, const Vec3& ray_direction, const Colour& pigment, const LightSource& light) {
  const Vec3 to_eye = -ray_direction;
  const Vec3 normal = dot(meeting.normal, to_eye) < 0 ? -meeting.normal : meeting.normal;
  const Vec3 to_light = normalized(light.position - meeting.point);
  return lit(meeting.texture->finish, pigment, normal, to_eye, to_light, light_at(light, meeting.point),
             !light.shadowless);
}

Colour mirrored(const TracedScene& scene, const Poses& poses, const Ray& ray, const Meeting& meeting, int level,
                double weight) {
  const Colour& share = meeting.texture->finish.reflection;
  const double most = std::max({share.x, share.y, share.z});
  const Ray reflected{meeting.point, ray.direction - meeting.normal * (2 * dot(ray.direction, meeting.normal))};
  return share * traced(scene, poses, reflected, RayKind::kReflected, level + 1, weight * most);
}

Colour shaded(const TracedScene& scene, const Poses& poses, const Ray& ray, const Meeting& meeting, int level,
              double weight) {
  const Finish& finish = meeting.texture->finish;
  const Colour pigment = pigment_colour(meeting.texture->pigment, meeting.pattern_point);
  Colour sum = unlit(finish, pigment, scene.scene().ambient_light);
  for (const LightSource& given : scene.scene().lights) {
    const LightSource light = placed(given, poses);
    const Colour part = light_of(meeting, ray.direction, pigment, light);
    if (part == Colour{}) continue;
    if (light.shadowless || !is_shadowed(scene, poses, meeting.point, light.position)) sum += part;
  }
  if (finish.reflection != Colour{}) sum += mirrored(scene, poses, ray, meeting, level, weight);
  return sum;
}

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/traced_scene.h"

#include <algorithm>
#include <utility>

#include "drivers/sim_povray/render/native/pigment_colour.h"
#include "drivers/sim_povray/render/native/shading.h"
#include "drivers/sim_povray/scene/evaluator.h"

namespace twocone::sim_povray {
namespace {

// Measured: POV-Ray sees no surface nearer than this to where a ray starts, and none nearer than the other number to
// either end of the way from a surface to a light casts a shadow.
constexpr double kNearest = 1e-4;
constexpr double kNearestShadow = 1e-3;

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
      part.no_shadow = part.no_shadow || object.no_shadow;
      part.no_image = part.no_image || object.no_image;
      part.no_reflection = part.no_reflection || object.no_reflection;
      add(part, mover);
    }
    return;
  }
  auto group = std::find_if(groups_.begin(), groups_.end(), [&](const Group& g) { return g.mover == mover; });
  if (group == groups_.end()) group = groups_.insert(groups_.end(), Group{.mover = mover});
  group->items.push_back({TracedSolid(object), object.texture.get(), next_number_++, !object.no_shadow,
                          !object.no_image, !object.no_reflection});
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

Colour shaded(const TracedScene& scene, const Poses& poses, const Ray& ray, const Meeting& meeting, int level,
              double weight) {
  const Finish& finish = meeting.texture->finish;
  const Colour pigment = pigment_colour(meeting.texture->pigment, meeting.pattern_point);
  const Vec3 to_eye = -ray.direction;
  const Vec3 normal = dot(meeting.normal, to_eye) < 0 ? -meeting.normal : meeting.normal;
  Colour sum = unlit(finish, pigment, scene.scene().ambient_light);
  for (const LightSource& given : scene.scene().lights) {
    LightSource light = given;
    if (light.mover != -1) {
      light.position = poses.of(given.mover).point(given.position);
      light.point_at = poses.of(given.mover).point(given.point_at);
    }
    const Vec3 to_light = normalized(light.position - meeting.point);
    const Colour part = lit(finish, pigment, normal, to_eye, to_light, light_at(light, meeting.point));
    if (part == Colour{}) continue;
    if (light.shadowless || !is_shadowed(scene, poses, meeting.point, light.position)) sum += part;
  }
  if (finish.reflection != Colour{}) {
    const Colour& share = finish.reflection;
    const Ray reflected{meeting.point, ray.direction - normal * (2 * dot(ray.direction, normal))};
    const double most = std::max({share.x, share.y, share.z});
    sum += share * traced(scene, poses, reflected, RayKind::kReflected, level + 1, weight * most);
  }
  return sum;
}

}  // namespace twocone::sim_povray

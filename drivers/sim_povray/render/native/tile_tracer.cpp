// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/tile_tracer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "drivers/sim_povray/render/native/pigment_colour.h"
#include "drivers/sim_povray/render/native/shading.h"

namespace twocone::sim_povray {
namespace {

/// Bounds of the origins and directions of a tile's rays.
class Beam {
 public:
  Beam(const Bounds3& origin, const Bounds3& direction)
      : x_(origin.low.x, origin.high.x, direction.low.x, direction.high.x),
        y_(origin.low.y, origin.high.y, direction.low.y, direction.high.y),
        z_(origin.low.z, origin.high.z, direction.low.z, direction.high.z) {}

  /// Returns a number that is not above where any of the rays enters the box, at least t_min; kInfinity if none of them
  /// meets it between t_min and t_max.
  [[nodiscard]] double entry(const Bounds3& box, double t_min, double t_max) const {
    double low = t_min;
    double high = t_max;
    x_.cut(box.low.x, box.high.x, low, high);
    y_.cut(box.low.y, box.high.y, low, high);
    z_.cut(box.low.z, box.high.z, low, high);
    // Rounding must not lose a box that a ray only touches.
    constexpr double kSlack = 1e-9;
    return low <= high * (1 + kSlack) + kSlack ? low * (1 - kSlack) - kSlack : kInfinity;
  }

 private:
  class Axis {
   public:
    Axis(double start_low, double start_high, double slope_low, double slope_high)
        : start_low_(start_low),
          start_high_(start_high),
          slope_low_(slope_low),
          slope_high_(slope_high),
          per_slope_low_(1 / slope_low),
          per_slope_high_(1 / slope_high) {}

    /// Narrows [low, high] to where rays may be between two planes.
    void cut(double from, double to, double& low, double& high) const {
      const double near_ahead = from - start_high_;  // > 0: all rays start below the box
      const double near_behind = to - start_low_;    // < 0: all rays start above it
      if (near_ahead > 0) {
        if (slope_high_ <= 0) {
          high = -kInfinity;
          return;
        }
        low = std::max(low, near_ahead * per_slope_high_);
        if (slope_low_ > 0) high = std::min(high, near_behind * per_slope_low_);
      } else if (near_behind < 0) {
        if (slope_low_ >= 0) {
          high = -kInfinity;
          return;
        }
        low = std::max(low, near_behind * per_slope_low_);
        if (slope_high_ < 0) high = std::min(high, near_ahead * per_slope_high_);
      } else if (slope_low_ > 0) {
        high = std::min(high, near_behind * per_slope_low_);
      } else if (slope_high_ < 0) {
        high = std::min(high, near_ahead * per_slope_high_);
      }
    }

   private:
    double start_low_, start_high_, slope_low_, slope_high_, per_slope_low_, per_slope_high_;
  };

  Axis x_, y_, z_;
};

/// Boxes of a hierarchy that a beam may meet.
class Candidates {
 public:
  struct Candidate {
    double entry;
    int index;
  };

  void find(const Bvh& bvh, const Beam& beam, double t_min, double t_max) {
    count_ = 0;
    if (bvh.empty()) return;
    std::array<int, 64> open;
    std::size_t depth = 0;
    open[depth++] = 0;
    while (depth > 0) {
      const Bvh::Node& node = bvh.nodes()[std::size_t(open[--depth])];
      const double entry = beam.entry(node.bounds, t_min, t_max);
      if (entry == kInfinity) continue;
      if (node.count == 0) {
        open[depth++] = node.first + 1;
        open[depth++] = node.first;
        continue;
      }
      for (int i = node.first; i < node.first + node.count; ++i) {
        const int index = bvh.order()[std::size_t(i)];
        const double at = node.count == 1 ? entry : beam.entry(bvh.boxes()[std::size_t(index)], t_min, t_max);
        if (at == kInfinity) continue;
        if (count_ == found_.size()) found_.resize(2 * count_ + 64);
        found_[count_++] = {at, index};
      }
    }
  }
  /// Orders them from near to far.
  void sort() {
    std::sort(found_.begin(), found_.begin() + std::ptrdiff_t(count_),
              [](const Candidate& a, const Candidate& b) { return a.entry < b.entry; });
  }
  [[nodiscard]] auto begin() const { return found_.begin(); }
  [[nodiscard]] auto end() const { return found_.begin() + std::ptrdiff_t(count_); }

 private:
  std::vector<Candidate> found_;  // grows to the largest number of any beam, then stays
  std::size_t count_ = 0;
};

/// What a thread needs for its tiles, so that no tile allocates.
struct Workspace {
  TileHits hits;
  std::array<Crossing, kTileRays> crossings;  // of what is hit, unless it is a box
  std::array<const Texture*, kTileRays> textures;
  TileSurfaces surfaces;
  RayTile local, shadow;
  Candidates candidates;
  Lane shadow_max, cosine, reflected_weights;
  RayBundle reflected;
  SeenTile reflected_seen;
};

/// Returns the calling thread's room for rays of a level.
Workspace& workspace(int level) {
  thread_local std::vector<std::unique_ptr<Workspace>> rooms;
  while (rooms.size() <= std::size_t(level)) {
    rooms.push_back(std::make_unique<Workspace>());
    rooms.back()->reflected.t_max.fill(kInfinity);
  }
  return *rooms[std::size_t(level)];
}

Ray ray_of(const RayTile& rays, int lane) { return {rays.origin.at(lane), rays.direction.at(lane)}; }

/// Returns the rays in a group's own coordinates; `room` holds them if they differ.
const RayTile& in_group(const PosedScene& posed, std::size_t group, const RayTile& rays, RayTile& room) {
  if (posed.scene().groups()[group].mover == -1) return rays;
  transform_rays(posed.group(group).to_group, rays.origin, rays.direction, room);
  return room;
}

/// Returns whether rays of the beam may meet what is in the box before t_max.
bool may_meet(const Beam& beam, const std::optional<Bounds3>& box, double t_max) {
  return !box || beam.entry(*box, 0, t_max) < kInfinity;
}

void find_nearest(const PosedScene& posed, const RayBundle& bundle, int level, GroupSet which, Workspace& w) {
  const auto is_seen = [level](const TracedScene::Item& item) {
    return level == 1 ? item.in_image : item.in_reflection;
  };
  w.hits.t = bundle.t_max;
  w.hits.number.fill(-1);
  const Beam scene_beam(limits_of(bundle.rays.origin), limits_of(bundle.rays.direction));
  double farthest = greatest_of(w.hits.t);
  const auto& groups = posed.scene().groups();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (g < kGroupBits && (which >> g & 1) == 0) continue;
    const TracedScene::Group& group = groups[g];
    const bool is_still = group.mover == -1;
    if (!is_still && !may_meet(scene_beam, posed.group(g).seen, farthest)) continue;
    const RayTile& rays = in_group(posed, g, bundle.rays, w.local);
    const auto meet = [&](const TracedScene::Item& item, std::uint64_t lanes) {
      for_each_lane(lanes, [&](int lane) {
        const auto i = std::size_t(lane);
        Crossing found;
        const double limit = w.hits.number[i] < 0 ? w.hits.t[i] : std::nextafter(w.hits.t[i], kInfinity);
        if (!item.solid.nearest(ray_of(rays, lane), kNearest, limit, found)) return;
        if (found.t == w.hits.t[i] && item.number > w.hits.number[i]) return;
        w.crossings[i] = found;
        w.hits.t[i] = found.t;
        w.hits.number[i] = item.number;
      });
    };
    for (const int index : group.unbounded) {
      const TracedScene::Item& item = group.items[std::size_t(index)];
      if (is_seen(item)) meet(item, bundle.used);
    }
    farthest = greatest_of(w.hits.t);
    if (group.bounded.empty()) continue;
    const Beam beam = is_still ? scene_beam : Beam(limits_of(rays.origin), limits_of(rays.direction));
    w.candidates.find(group.bounded, beam, kNearest, farthest);
    w.candidates.sort();
    for (const auto& candidate : w.candidates) {
      if (candidate.entry > farthest) break;
      const TracedScene::Item& item = group.items[std::size_t(group.bounded_items[std::size_t(candidate.index)])];
      if (!is_seen(item)) continue;
      if (item.is_box) {
        meet_box(rays, item.bounds, item.number, kNearest, w.hits);
      } else {
        meet(item, lanes_through(rays, item.bounds, kNearest, w.hits.t) & bundle.used);
      }
      farthest = greatest_of(w.hits.t);
    }
  }
}

/// Returns the lanes of `lanes` on whose way to the light (the rays w.shadow) something is.
std::uint64_t shadowed(const PosedScene& posed, const Vec3& light, std::uint64_t lanes, Workspace& w) {
  std::uint64_t dark = 0;
  // The rays seen from the light have one origin, and their bounds are much tighter. 1 is where they end.
  const auto beam_from = [](const Vec3& source, const RayTile& rays) {
    const Bounds3 ends = limits_of(rays.origin);
    return Beam({source, source}, {ends.low - source, ends.high - source});
  };
  const Beam scene_beam = beam_from(light, w.shadow);
  const auto& groups = posed.scene().groups();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const TracedScene::Group& group = groups[g];
    const bool is_still = group.mover == -1;
    if (!is_still && !may_meet(scene_beam, posed.group(g).shadows, 1)) continue;
    const RayTile& rays = in_group(posed, g, w.shadow, w.local);
    const auto block = [&](const TracedScene::Item& item, std::uint64_t open) {
      for_each_lane(open, [&](int lane) {
        const auto i = std::size_t(lane);
        if (item.solid.blocks(ray_of(rays, lane), kNearestShadow, w.shadow_max[i])) dark |= std::uint64_t{1} << lane;
      });
    };
    for (const int index : group.unbounded_shadows) block(group.items[std::size_t(index)], lanes & ~dark);
    if (group.shadows.empty()) continue;
    const Beam beam = is_still ? scene_beam : beam_from(posed.group(g).to_group.point(light), rays);
    w.candidates.find(group.shadows, beam, 0, 1);
    for (const auto& candidate : w.candidates) {
      const TracedScene::Item& item = group.items[std::size_t(group.shadow_items[std::size_t(candidate.index)])];
      if (item.is_box) {
        dark |= lanes_blocked(rays, item.bounds, kNearestShadow, w.shadow_max) & lanes;
      } else {
        block(item, lanes_through(rays, item.bounds, kNearestShadow, w.shadow_max) & lanes & ~dark);
      }
      if (dark == lanes) return dark;
    }
  }
  return dark;
}

/// Returns the normal of a box where a ray meets it at t, by the numbers of meet_box().
Vec3 normal_of_box(const Ray& ray, const Bounds3& box, double t) {
  const auto is_met = [t](double origin, double slope, double low, double high) {
    const double inverse = inverse_of(slope);
    return (low - origin) * inverse == t || (high - origin) * inverse == t;
  };
  if (is_met(ray.origin.x, ray.direction.x, box.low.x, box.high.x)) return {1, 0, 0};
  if (is_met(ray.origin.y, ray.direction.y, box.low.y, box.high.y)) return {0, 1, 0};
  return {0, 0, 1};
}

/// What lanes do with light.
struct Roles {
  std::uint64_t lit = 0;      // light sources change what they show,
  std::uint64_t special = 0;  // by more than diffuse light
  std::uint64_t mirrors = 0;
};

/// Sets what surfaces of one texture show without light sources.
/// @param pattern_point returns a lane's point in the coordinates around the pigment
template <class PatternPoint>
void paint(const EvaluatedScene& scene, const Texture& texture, std::uint64_t lanes, PatternPoint pattern_point,
           Workspace& w, SeenTile& seen, Roles& roles) {
  const Finish& finish = texture.finish;
  if (texture.pigment.pattern == Pattern::kColour) {
    const Colour pigment = pigment_colour(texture.pigment, {});
    fill(lanes, pigment, w.surfaces.pigments);
    fill(lanes, unlit(finish, pigment, scene.ambient_light), seen.colours);
  } else {
    for_each_lane(lanes, [&](int lane) {
      const Colour pigment = pigment_colour(texture.pigment, pattern_point(lane));
      w.surfaces.pigments.set(lane, pigment);
      seen.colours.set(lane, unlit(finish, pigment, scene.ambient_light));
    });
  }
  for_each_lane(lanes, [&](int lane) {
    w.surfaces.diffuse[std::size_t(lane)] = finish.diffuse;
    w.textures[std::size_t(lane)] = &texture;
  });
  if (shows_light(finish)) roles.lit |= lanes;
  if (finish.brilliance != 1 || finish.phong > 0 || finish.specular > 0) roles.special |= lanes;
  if (finish.reflection != Colour{}) roles.mirrors |= lanes;
}

/// Sets normals, textures and what an item shows without light sources in the lanes that meet it.
void show_item(const PosedScene& posed, const RayBundle& bundle, int number, std::uint64_t lanes, Workspace& w,
               SeenTile& seen, Roles& roles) {
  const auto [group_index, item_index] = posed.scene().place(number);
  const TracedScene::Group& group = posed.scene().groups()[std::size_t(group_index)];
  const TracedScene::Item& item = group.items[std::size_t(item_index)];
  const bool is_still = group.mover == -1;
  const Transform& to_group = posed.group(std::size_t(group_index)).to_group;
  const auto pattern_point = [&](int lane) {
    const Vec3 point = w.shadow.origin.at(lane);
    return is_still ? point : to_group.point(point);
  };
  const auto set_normal = [&](int lane, const Vec3& own) {
    const Vec3 normal = normalized(is_still ? own : posed.poses().of(group.mover).normal(own));
    w.surfaces.normals.set(lane, against(normal, bundle.rays.direction.at(lane)));
  };
  const EvaluatedScene& scene = posed.scene().scene();
  if (item.is_box) {
    if (is_still) {
      box_normals(bundle.rays, item.bounds, w.hits.t, lanes, w.surfaces.normals);
    } else {
      for_each_lane(lanes, [&](int lane) {
        const Ray local{to_group.point(bundle.rays.origin.at(lane)),
                        to_group.direction(bundle.rays.direction.at(lane))};
        set_normal(lane, normal_of_box(local, item.bounds, w.hits.t[std::size_t(lane)]));
      });
    }
    return paint(scene, *item.box_texture, lanes, pattern_point, w, seen, roles);
  }
  const auto texture_of = [&](int lane) {
    const Texture* const own = w.crossings[std::size_t(lane)].texture;
    return own != nullptr ? own : item.texture;
  };
  for_each_lane(lanes, [&](int lane) { set_normal(lane, w.crossings[std::size_t(lane)].normal); });
  while (lanes != 0) {
    const Texture* const texture = texture_of(std::countr_zero(lanes));
    std::uint64_t alike = 0;
    for_each_lane(lanes, [&](int lane) {
      if (texture_of(lane) == texture) alike |= std::uint64_t{1} << lane;
    });
    paint(scene, *texture, alike, pattern_point, w, seen, roles);
    lanes &= ~alike;
  }
}

/// Adds what light sources show of the surfaces.
void add_light(const PosedScene& posed, const RayBundle& bundle, const Roles& roles, Workspace& w, SeenTile& seen) {
  for (const LightSource& light : posed.lights()) {
    std::uint64_t facing =
        roles.lit & aim_at_light(light.position, w.surfaces.normals, kNearestShadow, w.shadow, w.shadow_max, w.cosine);
    const bool is_even = is_even_light(light);
    for_each_lane(is_even ? 0 : facing, [&](int lane) {
      if (light_at(light, w.shadow.origin.at(lane)) == Colour{}) facing &= ~(std::uint64_t{1} << lane);
    });
    if (facing == 0 || light.colour == Colour{}) continue;
    if (!light.shadowless) facing &= ~shadowed(posed, light.position, facing, w);
    const std::uint64_t special = is_even ? facing & roles.special : facing;
    add_diffuse(facing & ~special, w.surfaces, w.cosine, light.colour, seen.colours);
    for_each_lane(special, [&](int lane) {
      const Colour part = lit(w.textures[std::size_t(lane)]->finish, w.surfaces.pigments.at(lane),
                              w.surfaces.normals.at(lane), -bundle.rays.direction.at(lane), w.shadow.direction.at(lane),
                              light_at(light, w.shadow.origin.at(lane)), !light.shadowless);
      seen.colours.set(lane, seen.colours.at(lane) + part);
    });
  }
}

/// Adds what reflecting surfaces show of their surroundings.
void reflect(const PosedScene& posed, const RayBundle& bundle, int level, std::uint64_t lanes, const Lane& weights,
             Workspace& w, SeenTile& seen) {
  const EvaluatedScene& scene = posed.scene().scene();
  if (level >= scene.max_trace_level) return;
  w.reflected.used = 0;
  for_each_lane(lanes, [&](int lane) {
    const auto i = std::size_t(lane);
    const Colour& share = w.textures[i]->finish.reflection;
    w.reflected_weights[i] = weights[i] * greatest_component(share);
    if (w.reflected_weights[i] < scene.adc_bailout) return;
    w.reflected.used |= std::uint64_t{1} << lane;
    const Vec3 direction = bundle.rays.direction.at(lane);
    const Vec3 normal = w.surfaces.normals.at(lane);
    w.reflected.rays.origin.set(lane, w.shadow.origin.at(lane));
    w.reflected.rays.direction.set(lane, direction - normal * (2 * dot(direction, normal)));
  });
  if (w.reflected.used == 0) return;
  fill_unused(w.reflected);
  trace_tile(posed, w.reflected, level + 1, kAllGroups, w.reflected_weights, w.reflected_seen);
  seen.mirrored = w.reflected.used;
  seen.reflected = &w.reflected_seen;
  for_each_lane(w.reflected.used, [&](int lane) {
    const Colour part = w.textures[std::size_t(lane)]->finish.reflection * w.reflected_seen.colours.at(lane);
    seen.colours.set(lane, seen.colours.at(lane) + part);
  });
}

}  // namespace

void fill_unused(RayBundle& bundle) {
  const int any = std::countr_zero(bundle.used);
  for_each_lane(~bundle.used, [&](int lane) {
    bundle.rays.origin.set(lane, bundle.rays.origin.at(any));
    bundle.rays.direction.set(lane, bundle.rays.direction.at(any));
  });
  invert_directions(bundle.rays);
}

void trace_tile(const PosedScene& posed, const RayBundle& bundle, int level, GroupSet which, const Lane& weights,
                SeenTile& seen) {
  Workspace& w = workspace(level);
  find_nearest(posed, bundle, level, which, w);
  seen.hits = &w.hits;
  seen.normals = &w.surfaces.normals;
  seen.textures = &w.textures;
  seen.mirrored = 0;
  seen.met = bundle.used & ~lanes_with(w.hits.number, -1);
  for_each_lane(bundle.used & ~seen.met, [&](int lane) {
    seen.colours.set(lane, sky_colour(posed.scene().scene(), bundle.rays.direction.at(lane)));
  });
  if (seen.met == 0) return;
  points_along(bundle.rays, w.hits.t, w.shadow.origin);
  Roles roles;
  for (std::uint64_t left = seen.met; left != 0;) {
    const double number = w.hits.number[std::size_t(std::countr_zero(left))];
    const std::uint64_t lanes = left & lanes_with(w.hits.number, number);
    show_item(posed, bundle, int(number), lanes, w, seen, roles);
    left &= ~lanes;
  }
  const int any = std::countr_zero(seen.met);
  for_each_lane(~seen.met, [&](int lane) {
    w.shadow.origin.set(lane, w.shadow.origin.at(any));
    w.surfaces.normals.set(lane, w.surfaces.normals.at(any));
  });
  if (roles.lit != 0) add_light(posed, bundle, roles, w, seen);
  if (roles.mirrors != 0) reflect(posed, bundle, level, roles.mirrors, weights, w, seen);
}

}  // namespace twocone::sim_povray

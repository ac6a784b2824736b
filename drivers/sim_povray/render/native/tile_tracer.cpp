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
  TileVectors normals;  // towards where the rays come from
  RayTile local, shadow;
  RayBundle reflected;
  Candidates candidates;
  Lane shadow_min, shadow_max, cosine;
  Lane reflected_weights;
  std::array<Colour, kTileRays> pigments;
  SeenTile reflected_seen;
  std::array<Meeting, kTileRays> meetings;
  std::array<Crossing, kTileRays> crossings;  // of what is hit, unless it is a box
};

/// Returns the calling thread's room for rays of a level.
Workspace& workspace(int level) {
  thread_local std::vector<std::unique_ptr<Workspace>> rooms;
  while (rooms.size() <= std::size_t(level)) {
    rooms.push_back(std::make_unique<Workspace>());
    rooms.back()->shadow_min.fill(kNearestShadow);
    rooms.back()->reflected.t_max.fill(kInfinity);
  }
  return *rooms[std::size_t(level)];
}

Ray ray_of(const RayTile& rays, int lane) { return {rays.origin.at(lane), rays.direction.at(lane)}; }

/// Returns the rays in a group's own coordinates; `room` holds them if they differ.
const RayTile& in_group(const TracedScene::Group& group, const Poses& poses, const RayTile& rays, RayTile& room) {
  if (group.mover == -1) return rays;
  transform_rays(poses.of(group.mover).inverse(), rays.origin, rays.direction, room);
  return room;
}

void find_nearest(const TracedScene& scene, const Poses& poses, const RayBundle& bundle, int level, GroupSet which,
                  Workspace& w) {
  const auto is_seen = [level](const TracedScene::Item& item) {
    return level == 1 ? item.in_image : item.in_reflection;
  };
  w.hits.t = bundle.t_max;
  w.hits.number.fill(-1);
  const auto& groups = scene.groups();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (g < kGroupBits && (which >> g & 1) == 0) continue;
    const TracedScene::Group& group = groups[g];
    const RayTile& rays = in_group(group, poses, bundle.rays, w.local);
    const auto meet = [&](const TracedScene::Item& item, std::uint64_t lanes) {
      for_each_lane(lanes, [&](int lane) {
        const auto i = std::size_t(lane);
        Crossing found;
        const double farthest = w.hits.number[i] < 0 ? w.hits.t[i] : std::nextafter(w.hits.t[i], kInfinity);
        if (!item.solid.nearest(ray_of(rays, lane), kNearest, farthest, found)) return;
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
    if (group.bounded.empty()) continue;
    const Beam beam(limits_of(rays.origin), limits_of(rays.direction));
    double farthest = greatest_of(w.hits.t);
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
std::uint64_t shadowed(const TracedScene& scene, const Poses& poses, const Vec3& light, std::uint64_t lanes,
                       Workspace& w) {
  std::uint64_t dark = 0;
  for (const TracedScene::Group& group : scene.groups()) {
    const RayTile& rays = in_group(group, poses, w.shadow, w.local);
    const auto block = [&](const TracedScene::Item& item, std::uint64_t open) {
      for_each_lane(open, [&](int lane) {
        const auto i = std::size_t(lane);
        if (item.solid.blocks(ray_of(rays, lane), w.shadow_min[i], w.shadow_max[i])) dark |= std::uint64_t{1} << lane;
      });
    };
    for (const int index : group.unbounded_shadows) block(group.items[std::size_t(index)], lanes & ~dark);
    if (group.shadows.empty()) continue;
    // The rays seen from the light have one origin, and their bounds are much tighter. 1 is where they end.
    const Vec3 source = group.mover == -1 ? light : poses.of(group.mover).inverse_point(light);
    const Bounds3 ends = limits_of(rays.origin);
    const Beam beam({source, source}, {ends.low - source, ends.high - source});
    w.candidates.find(group.shadows, beam, 0, 1);
    for (const auto& candidate : w.candidates) {
      const TracedScene::Item& item = group.items[std::size_t(group.shadow_items[std::size_t(candidate.index)])];
      if (item.is_box) {
        dark |= lanes_blocked(rays, item.bounds, w.shadow_min, w.shadow_max) & lanes;
      } else {
        block(item, lanes_through(rays, item.bounds, kNearestShadow, w.shadow_max) & lanes & ~dark);
      }
      if (dark == lanes) return dark;
    }
  }
  return dark;
}

/// Adds what reflecting surfaces show of their surroundings.
void reflect(const TracedScene& scene, const Poses& poses, const RayBundle& bundle, int level, const Lane& weights,
             Workspace& w, SeenTile& seen) {
  const EvaluatedScene& description = scene.scene();
  if (level >= description.max_trace_level) return;
  w.reflected.used = 0;
  for_each_lane(seen.met, [&](int lane) {
    const auto i = std::size_t(lane);
    const Colour& share = w.meetings[i].texture->finish.reflection;
    w.reflected_weights[i] = weights[i] * std::max({share.x, share.y, share.z});
    if (share == Colour{} || w.reflected_weights[i] < description.adc_bailout) return;
    w.reflected.used |= std::uint64_t{1} << lane;
    const Vec3 direction = bundle.rays.direction.at(lane);
    const Vec3 normal = w.meetings[i].normal;
    w.reflected.rays.origin.set(lane, w.meetings[i].point);
    w.reflected.rays.direction.set(lane, direction - normal * (2 * dot(direction, normal)));
  });
  if (w.reflected.used == 0) return;
  fill_unused(w.reflected);
  trace_tile(scene, poses, w.reflected, level + 1, kAllGroups, w.reflected_weights, w.reflected_seen);
  for_each_lane(w.reflected.used, [&](int lane) {
    const auto i = std::size_t(lane);
    const bool met = (w.reflected_seen.met >> lane & 1) != 0;
    seen.colours[i] +=
        w.meetings[i].texture->finish.reflection *
        (met ? w.reflected_seen.colours[i] : sky_colour(description, w.reflected.rays.direction.at(lane)));
  });
}

/// Returns the normal of a box where one of the rays meets it at t, by meet_box()'s own numbers.
Vec3 normal_of_box(const RayTile& rays, int lane, const Bounds3& box, double t) {
  const Vec3 origin = rays.origin.at(lane);
  const Vec3 inverse = rays.inverse.at(lane);
  const Vec3 low = (box.low - origin) * inverse;
  const Vec3 high = (box.high - origin) * inverse;
  if (low.x == t) return {-1, 0, 0};
  if (high.x == t) return {1, 0, 0};
  if (low.y == t) return {0, -1, 0};
  if (high.y == t) return {0, 1, 0};
  return low.z == t ? Vec3{0, 0, -1} : Vec3{0, 0, 1};
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

void trace_tile(const TracedScene& scene, const Poses& poses, const RayBundle& bundle, int level, GroupSet which,
                const Lane& weights, SeenTile& seen) {
  Workspace& w = workspace(level);
  find_nearest(scene, poses, bundle, level, which, w);
  seen.met = w.reflected_seen.met = 0;
  seen.meetings = &w.meetings;
  seen.reflected = &w.reflected_seen;
  std::uint64_t needs_light = 0;
  const EvaluatedScene& description = scene.scene();
  for_each_lane(bundle.used, [&](int lane) {
    const auto i = std::size_t(lane);
    if (w.hits.number[i] < 0) return;
    const Ray ray = ray_of(bundle.rays, lane);
    const auto [group_index, item_index] = scene.place(int(w.hits.number[i]));
    const TracedScene::Group& group = scene.groups()[std::size_t(group_index)];
    const TracedScene::Item& item = group.items[std::size_t(item_index)];
    if (!item.is_box) {
      w.meetings[i] = meeting_at(poses, ray, group, item, w.crossings[i]);
    } else if (group.mover == -1) {
      const double t = w.hits.t[i];
      const Vec3 point = ray.at(t);
      w.meetings[i] = {
          t, &group, item.box_texture, point, point, normal_of_box(bundle.rays, lane, item.bounds, t), item.number};
    } else {
      const auto meeting = meeting_with(poses, ray, group, item);
      if (!meeting) return;  // it only touches an edge
      w.meetings[i] = *meeting;
    }
    seen.met |= std::uint64_t{1} << lane;
    const Meeting& meeting = w.meetings[i];
    w.shadow.origin.set(lane, meeting.point);
    w.normals.set(lane, dot(meeting.normal, ray.direction) > 0 ? -meeting.normal : meeting.normal);
    w.pigments[i] = pigment_colour(meeting.texture->pigment, meeting.pattern_point);
    seen.colours[i] = unlit(meeting.texture->finish, w.pigments[i], description.ambient_light);
    if (shows_light(meeting.texture->finish)) needs_light |= std::uint64_t{1} << lane;
  });
  if (seen.met == 0) return;
  const int any = std::countr_zero(seen.met);
  for_each_lane(~seen.met, [&](int lane) {
    w.shadow.origin.set(lane, w.shadow.origin.at(any));
    w.normals.set(lane, w.normals.at(any));
  });
  for (const LightSource& given : description.lights) {
    const LightSource light = placed(given, poses);
    aim_at_light(light.position, w.normals, w.shadow, w.shadow_max, w.cosine);
    std::uint64_t facing = 0;
    for_each_lane(needs_light, [&](int lane) {
      const auto i = std::size_t(lane);
      w.shadow_max[i] -= kNearestShadow;
      if (w.cosine[i] > 0 && light_at(light, w.meetings[i].point) != Colour{}) facing |= std::uint64_t{1} << lane;
    });
    if (facing == 0) continue;
    if (!light.shadowless) facing &= ~shadowed(scene, poses, light.position, facing, w);
    for_each_lane(facing, [&](int lane) {
      const auto i = std::size_t(lane);
      seen.colours[i] +=
          lit(w.meetings[i].texture->finish, w.pigments[i], w.normals.at(lane), -bundle.rays.direction.at(lane),
              w.shadow.direction.at(lane), light_at(light, w.meetings[i].point), !light.shadowless);
    });
  }
  reflect(scene, poses, bundle, level, weights, w, seen);
}

}  // namespace twocone::sim_povray

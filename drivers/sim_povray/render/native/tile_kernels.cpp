// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/tile_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "drivers/sim_povray/render/native/tile_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// The lines up to HWY_ONCE are compiled once for each instruction set.
HWY_BEFORE_NAMESPACE();
namespace twocone::sim_povray::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;
using Vector = hn::Vec<Doubles>;
constexpr Doubles kDoubles;

Vector load(const Lane& lane, std::size_t i) { return hn::LoadU(kDoubles, lane.data() + i); }
void store(const Vector& value, Lane& lane, std::size_t i) { hn::StoreU(value, kDoubles, lane.data() + i); }
Vector all(double value) { return hn::Set(kDoubles, value); }
std::size_t step() { return hn::Lanes(kDoubles); }

/// Returns a x + b y + c z (+ d), in this order.
Vector combine(double a, double b, double c, const Vector& x, const Vector& y, const Vector& z) {
  return hn::Add(hn::Add(hn::Mul(all(a), x), hn::Mul(all(b), y)), hn::Mul(all(c), z));
}

struct Span {
  Vector entry, exit;
};

/// Returns where the lines enter and leave the box; entry > exit: they miss it.
Span cross(const RayTile& rays, const Bounds3& box, std::size_t i) {
  const auto slab = [&](const Lane& origin, const Lane& inverse, double low, double high) {
    const Vector o = load(origin, i);
    const Vector n = load(inverse, i);
    const Vector a = hn::Mul(hn::Sub(all(low), o), n);
    const Vector b = hn::Mul(hn::Sub(all(high), o), n);
    return Span{hn::Min(a, b), hn::Max(a, b)};
  };
  const Span x = slab(rays.origin.x, rays.inverse.x, box.low.x, box.high.x);
  const Span y = slab(rays.origin.y, rays.inverse.y, box.low.y, box.high.y);
  const Span z = slab(rays.origin.z, rays.inverse.z, box.low.z, box.high.z);
  return {hn::Max(hn::Max(x.entry, y.entry), z.entry), hn::Min(hn::Min(x.exit, y.exit), z.exit)};
}

template <class Mask>
std::uint64_t bits_of(const Mask& mask, std::size_t i) {
  std::uint8_t bits = 0;
  hn::StoreMaskBits(kDoubles, mask, &bits);
  return std::uint64_t(bits) << i;
}

void TransformRays(const Transform& transform, const TileVectors& origin, const TileVectors& direction,
                   RayTile& result) {
  const auto& r = transform.rows();
  const Vec3& o = transform.offset();
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    const Vector x = load(origin.x, i);
    const Vector y = load(origin.y, i);
    const Vector z = load(origin.z, i);
    store(hn::Add(combine(r[0].x, r[1].x, r[2].x, x, y, z), all(o.x)), result.origin.x, i);
    store(hn::Add(combine(r[0].y, r[1].y, r[2].y, x, y, z), all(o.y)), result.origin.y, i);
    store(hn::Add(combine(r[0].z, r[1].z, r[2].z, x, y, z), all(o.z)), result.origin.z, i);
    const Vector u = load(direction.x, i);
    const Vector v = load(direction.y, i);
    const Vector w = load(direction.z, i);
    store(combine(r[0].x, r[1].x, r[2].x, u, v, w), result.direction.x, i);
    store(combine(r[0].y, r[1].y, r[2].y, u, v, w), result.direction.y, i);
    store(combine(r[0].z, r[1].z, r[2].z, u, v, w), result.direction.z, i);
  }
}

void InvertDirections(RayTile& rays) {
  // 1 / this is finite.
  constexpr double kTiny = 1e-300;
  const auto invert = [](const Lane& direction, Lane& inverse) {
    for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
      const Vector d = load(direction, i);
      const Vector safe = hn::IfThenElse(hn::Lt(hn::Abs(d), all(kTiny)), all(kTiny), d);
      store(hn::Div(all(1.0), safe), inverse, i);
    }
  };
  invert(rays.direction.x, rays.inverse.x);
  invert(rays.direction.y, rays.inverse.y);
  invert(rays.direction.z, rays.inverse.z);
}

double GreatestOf(const Lane& lane) {
  Vector most = load(lane, 0);
  for (std::size_t i = step(); i < std::size_t(kTileRays); i += step()) most = hn::Max(most, load(lane, i));
  return hn::GetLane(hn::MaxOfLanes(kDoubles, most));
}

Bounds3 LimitsOf(const TileVectors& vectors) {
  const auto limits = [](const Lane& lane, double& low, double& high) {
    Vector least = load(lane, 0);
    Vector most = least;
    for (std::size_t i = step(); i < std::size_t(kTileRays); i += step()) {
      least = hn::Min(least, load(lane, i));
      most = hn::Max(most, load(lane, i));
    }
    low = hn::GetLane(hn::MinOfLanes(kDoubles, least));
    high = hn::GetLane(hn::MaxOfLanes(kDoubles, most));
  };
  Bounds3 result;
  limits(vectors.x, result.low.x, result.high.x);
  limits(vectors.y, result.low.y, result.high.y);
  limits(vectors.z, result.low.z, result.high.z);
  return result;
}

void MeetBox(const RayTile& rays, const Bounds3& box, double number, double t_min, TileHits& hits) {
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    const Span span = cross(rays, box, i);
    const Vector t = hn::IfThenElse(hn::Gt(span.entry, all(t_min)), span.entry, span.exit);
    const Vector best = load(hits.t, i);
    const Vector best_number = load(hits.number, i);
    const auto nearer = hn::Or(hn::Lt(t, best), hn::And(hn::Eq(t, best), hn::Lt(all(number), best_number)));
    const auto met = hn::And(hn::And(hn::Le(span.entry, span.exit), hn::Gt(t, all(t_min))), nearer);
    store(hn::IfThenElse(met, t, best), hits.t, i);
    store(hn::IfThenElse(met, all(number), best_number), hits.number, i);
  }
}

std::uint64_t LanesThrough(const RayTile& rays, const Bounds3& box, double t_min, const Lane& t) {
  std::uint64_t lanes = 0;
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    const Span span = cross(rays, box, i);
    lanes |= bits_of(hn::Le(hn::Max(span.entry, all(t_min)), hn::Min(span.exit, load(t, i))), i);
  }
  return lanes;
}

std::uint64_t LanesBlocked(const RayTile& rays, const Bounds3& box, const Lane& t_min, const Lane& t) {
  std::uint64_t lanes = 0;
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    const Span span = cross(rays, box, i);
    const Vector low = load(t_min, i);
    const Vector high = load(t, i);
    const auto enters = hn::And(hn::Gt(span.entry, low), hn::Lt(span.entry, high));
    const auto leaves = hn::And(hn::Gt(span.exit, low), hn::Lt(span.exit, high));
    lanes |= bits_of(hn::And(hn::Le(span.entry, span.exit), hn::Or(enters, leaves)), i);
  }
  return lanes;
}

void AimAtLight(const Vec3& light, const TileVectors& normals, RayTile& rays, Lane& distance, Lane& cosine) {
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    const Vector x = hn::Sub(all(light.x), load(rays.origin.x, i));
    const Vector y = hn::Sub(all(light.y), load(rays.origin.y, i));
    const Vector z = hn::Sub(all(light.z), load(rays.origin.z, i));
    const Vector length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
    const Vector u = hn::Div(x, length);
    const Vector v = hn::Div(y, length);
    const Vector w = hn::Div(z, length);
    store(u, rays.direction.x, i);
    store(v, rays.direction.y, i);
    store(w, rays.direction.z, i);
    store(length, distance, i);
    store(hn::Add(hn::Add(hn::Mul(u, load(normals.x, i)), hn::Mul(v, load(normals.y, i))),
                  hn::Mul(w, load(normals.z, i))),
          cosine, i);
  }
  InvertDirections(rays);
}

std::string InstructionSet() { return hwy::TargetName(HWY_TARGET); }

}  // namespace
}  // namespace twocone::sim_povray::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace twocone::sim_povray {

HWY_EXPORT(TransformRays);
HWY_EXPORT(InvertDirections);
HWY_EXPORT(GreatestOf);
HWY_EXPORT(LimitsOf);
HWY_EXPORT(MeetBox);
HWY_EXPORT(LanesThrough);
HWY_EXPORT(LanesBlocked);
HWY_EXPORT(AimAtLight);
HWY_EXPORT(InstructionSet);

void transform_rays(const Transform& transform, const TileVectors& origin, const TileVectors& direction,
                    RayTile& result) {
  HWY_DYNAMIC_DISPATCH(TransformRays)(transform, origin, direction, result);
  HWY_DYNAMIC_DISPATCH(InvertDirections)(result);
}
void invert_directions(RayTile& rays) { HWY_DYNAMIC_DISPATCH(InvertDirections)(rays); }
double greatest_of(const Lane& lane) { return HWY_DYNAMIC_DISPATCH(GreatestOf)(lane); }
Bounds3 limits_of(const TileVectors& vectors) { return HWY_DYNAMIC_DISPATCH(LimitsOf)(vectors); }
void meet_box(const RayTile& rays, const Bounds3& box, double number, double t_min, TileHits& hits) {
  HWY_DYNAMIC_DISPATCH(MeetBox)(rays, box, number, t_min, hits);
}
std::uint64_t lanes_through(const RayTile& rays, const Bounds3& box, double t_min, const Lane& t) {
  return HWY_DYNAMIC_DISPATCH(LanesThrough)(rays, box, t_min, t);
}
std::uint64_t lanes_blocked(const RayTile& rays, const Bounds3& box, const Lane& t_min, const Lane& t) {
  return HWY_DYNAMIC_DISPATCH(LanesBlocked)(rays, box, t_min, t);
}
void aim_at_light(const Vec3& light, const TileVectors& normals, RayTile& rays, Lane& distance, Lane& cosine) {
  HWY_DYNAMIC_DISPATCH(AimAtLight)(light, normals, rays, distance, cosine);
}
std::string instruction_set() { return HWY_DYNAMIC_DISPATCH(InstructionSet)(); }

}  // namespace twocone::sim_povray
#endif  // HWY_ONCE

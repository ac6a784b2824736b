// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/tile_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "drivers/sim_povray/render/native/tile_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef TWOCONE_BYTE_TABLE
#define TWOCONE_BYTE_TABLE
namespace twocone::sim_povray {

/// The byte near a linear component, by cells from 0 to 1.
struct ByteTable {
  // Finer than the distance of two bytes everywhere, so that a cell holds at most two.
  static constexpr int kCells = 8192;

  ByteTable() {
    const auto decoded = [](double srgb) {
      return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
    };
    // The least component that has the next byte.
    const auto least_after = [&](int byte) { return byte == 255 ? 2 : decoded((byte + 0.5) / 255); };
    int byte = 0;
    for (int cell = 0; cell <= kCells; ++cell) {
      while (double(cell) / kCells >= least_after(byte)) ++byte;
      first[std::size_t(cell)] = byte;
      next[std::size_t(cell)] = least_after(byte);
    }
  }

  std::array<double, kCells + 1> first{}, next{};
};

}  // namespace twocone::sim_povray
#endif

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

// Masks are written and read in up to 8 bytes.
template <class Mask>
std::uint64_t bits_of(const Mask& mask, std::size_t i) {
  std::array<std::uint8_t, 8> bits{};
  hn::StoreMaskBits(kDoubles, mask, bits.data());
  return std::uint64_t(bits[0]) << i;
}
auto mask_of(std::uint64_t lanes, std::size_t i) {
  const std::array<std::uint8_t, 8> bits{static_cast<std::uint8_t>(lanes >> i & ((1U << step()) - 1))};
  return hn::LoadMaskBits(kDoubles, bits.data());
}
void store_where(std::uint64_t lanes, const Vector& value, Lane& lane, std::size_t i) {
  store(hn::IfThenElse(mask_of(lanes, i), value, load(lane, i)), lane, i);
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
  const auto invert = [](const Lane& direction, Lane& inverse) {
    for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
      const Vector d = load(direction, i);
      const Vector safe = hn::IfThenElse(hn::Lt(hn::Abs(d), all(kLeastComponent)), all(kLeastComponent), d);
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

std::uint64_t LanesBlocked(const RayTile& rays, const Bounds3& box, double t_min, const Lane& t) {
  std::uint64_t lanes = 0;
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    const Span span = cross(rays, box, i);
    const Vector low = all(t_min);
    const Vector high = load(t, i);
    const auto enters = hn::And(hn::Gt(span.entry, low), hn::Lt(span.entry, high));
    const auto leaves = hn::And(hn::Gt(span.exit, low), hn::Lt(span.exit, high));
    lanes |= bits_of(hn::And(hn::Le(span.entry, span.exit), hn::Or(enters, leaves)), i);
  }
  return lanes;
}

std::uint64_t LanesWith(const Lane& lane, double number) {
  std::uint64_t lanes = 0;
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    lanes |= bits_of(hn::Eq(load(lane, i), all(number)), i);
  }
  return lanes;
}

void PointsAlong(const RayTile& rays, const Lane& t, TileVectors& points) {
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    const Vector at = load(t, i);
    store(hn::Add(load(rays.origin.x, i), hn::Mul(load(rays.direction.x, i), at)), points.x, i);
    store(hn::Add(load(rays.origin.y, i), hn::Mul(load(rays.direction.y, i), at)), points.y, i);
    store(hn::Add(load(rays.origin.z, i), hn::Mul(load(rays.direction.z, i), at)), points.z, i);
  }
}

void BoxNormals(const RayTile& rays, const Bounds3& box, const Lane& t, std::uint64_t lanes, TileVectors& normals) {
  const Vector zero = all(0);
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    const Vector at = load(t, i);
    // Faces in the order x, y, z, by the numbers with which cross() found them.
    const auto is_met = [&](const Lane& origin, const Lane& inverse, double low, double high) {
      const Vector o = load(origin, i);
      const Vector n = load(inverse, i);
      return hn::Or(hn::Eq(hn::Mul(hn::Sub(all(low), o), n), at), hn::Eq(hn::Mul(hn::Sub(all(high), o), n), at));
    };
    const auto in_x = is_met(rays.origin.x, rays.inverse.x, box.low.x, box.high.x);
    const auto in_y = hn::AndNot(in_x, is_met(rays.origin.y, rays.inverse.y, box.low.y, box.high.y));
    const auto not_z = hn::Or(in_x, in_y);
    const auto against = [&](const Lane& direction) {
      return hn::IfThenElse(hn::Gt(load(direction, i), zero), all(-1), all(1));
    };
    store_where(lanes, hn::IfThenElse(in_x, against(rays.direction.x), zero), normals.x, i);
    store_where(lanes, hn::IfThenElse(in_y, against(rays.direction.y), zero), normals.y, i);
    store_where(lanes, hn::IfThenElse(not_z, zero, against(rays.direction.z)), normals.z, i);
  }
}

std::uint64_t AimAtLight(const Vec3& light, const TileVectors& normals, double margin, RayTile& rays, Lane& t_max,
                         Lane& cosine) {
  std::uint64_t facing = 0;
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
    store(hn::Sub(length, all(margin)), t_max, i);
    const Vector c = hn::Add(hn::Add(hn::Mul(u, load(normals.x, i)), hn::Mul(v, load(normals.y, i))),
                             hn::Mul(w, load(normals.z, i)));
    store(c, cosine, i);
    facing |= bits_of(hn::Gt(c, all(0)), i);
  }
  InvertDirections(rays);
  return facing;
}

void Fill(std::uint64_t lanes, const Vec3& value, TileVectors& vectors) {
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    store_where(lanes, all(value.x), vectors.x, i);
    store_where(lanes, all(value.y), vectors.y, i);
    store_where(lanes, all(value.z), vectors.z, i);
  }
}

void AddDiffuse(std::uint64_t lanes, const TileSurfaces& surfaces, const Lane& cosine, const Vec3& light,
                TileVectors& colours) {
  const TileVectors& pigments = surfaces.pigments;
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    const Vector scattered = hn::Mul(load(surfaces.diffuse, i), load(cosine, i));
    const auto add = [&](const Lane& pigment, double component, Lane& colour) {
      const Vector part = hn::Mul(hn::Mul(load(pigment, i), scattered), all(component));
      store_where(lanes, hn::Add(load(colour, i), part), colour, i);
    };
    add(pigments.x, light.x, colours.x);
    add(pigments.y, light.y, colours.y);
    add(pigments.z, light.z, colours.z);
  }
}

void Mix(std::uint64_t lanes, const Vec3& base, const Vec3& share, const TileVectors& seen, TileVectors& colours) {
  for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
    store_where(lanes, hn::Add(all(base.x), hn::Mul(all(share.x), load(seen.x, i))), colours.x, i);
    store_where(lanes, hn::Add(all(base.y), hn::Mul(all(share.y), load(seen.y, i))), colours.y, i);
    store_where(lanes, hn::Add(all(base.z), hn::Mul(all(share.z), load(seen.z, i))), colours.z, i);
  }
}

void SrgbBytes(const ByteTable& table, const TileVectors& colours, TileBytes& bytes) {
  const hn::RebindToSigned<Doubles> integers;
  const auto convert = [&](const Lane& component, std::size_t first) {
    HWY_ALIGN std::array<std::int64_t, kTileRays> found;
    for (std::size_t i = 0; i < std::size_t(kTileRays); i += step()) {
      const Vector light = hn::Min(hn::Max(load(component, i), all(0)), all(1));
      const auto cell = hn::ConvertTo(integers, hn::Mul(light, all(ByteTable::kCells)));
      const Vector byte = hn::GatherIndex(kDoubles, table.first.data(), cell);
      const Vector next = hn::GatherIndex(kDoubles, table.next.data(), cell);
      const Vector result = hn::IfThenElse(hn::Ge(light, next), hn::Add(byte, all(1)), byte);
      hn::StoreU(hn::ConvertTo(integers, result), integers, found.data() + i);
    }
    for (std::size_t i = 0; i < std::size_t(kTileRays); ++i) bytes[3 * i + first] = static_cast<std::uint8_t>(found[i]);
  };
  convert(colours.x, 0);
  convert(colours.y, 1);
  convert(colours.z, 2);
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
HWY_EXPORT(LanesWith);
HWY_EXPORT(PointsAlong);
HWY_EXPORT(BoxNormals);
HWY_EXPORT(AimAtLight);
HWY_EXPORT(Fill);
HWY_EXPORT(AddDiffuse);
HWY_EXPORT(Mix);
HWY_EXPORT(SrgbBytes);
HWY_EXPORT(InstructionSet);

void transform_rays(const Transform& transform, const TileVectors& origin, const TileVectors& direction,
                    RayTile& result) {
  HWY_DYNAMIC_DISPATCH(TransformRays)(transform, origin, direction, result);
  HWY_DYNAMIC_DISPATCH(InvertDirections)(result);
}
void invert_directions(RayTile& rays) { HWY_DYNAMIC_DISPATCH(InvertDirections)(rays); }
double greatest_of(const Lane& lane) { return HWY_DYNAMIC_DISPATCH(GreatestOf)(lane); }
Bounds3 limits_of(const TileVectors& vectors) { return HWY_DYNAMIC_DISPATCH(LimitsOf)(vectors); }
std::uint64_t lanes_with(const Lane& lane, double number) { return HWY_DYNAMIC_DISPATCH(LanesWith)(lane, number); }
void meet_box(const RayTile& rays, const Bounds3& box, double number, double t_min, TileHits& hits) {
  HWY_DYNAMIC_DISPATCH(MeetBox)(rays, box, number, t_min, hits);
}
std::uint64_t lanes_through(const RayTile& rays, const Bounds3& box, double t_min, const Lane& t) {
  return HWY_DYNAMIC_DISPATCH(LanesThrough)(rays, box, t_min, t);
}
std::uint64_t lanes_blocked(const RayTile& rays, const Bounds3& box, double t_min, const Lane& t) {
  return HWY_DYNAMIC_DISPATCH(LanesBlocked)(rays, box, t_min, t);
}
void points_along(const RayTile& rays, const Lane& t, TileVectors& points) {
  HWY_DYNAMIC_DISPATCH(PointsAlong)(rays, t, points);
}
void box_normals(const RayTile& rays, const Bounds3& box, const Lane& t, std::uint64_t lanes, TileVectors& normals) {
  HWY_DYNAMIC_DISPATCH(BoxNormals)(rays, box, t, lanes, normals);
}
std::uint64_t aim_at_light(const Vec3& light, const TileVectors& normals, double margin, RayTile& rays, Lane& t_max,
                           Lane& cosine) {
  return HWY_DYNAMIC_DISPATCH(AimAtLight)(light, normals, margin, rays, t_max, cosine);
}
void fill(std::uint64_t lanes, const Vec3& value, TileVectors& vectors) {
  HWY_DYNAMIC_DISPATCH(Fill)(lanes, value, vectors);
}
void add_diffuse(std::uint64_t lanes, const TileSurfaces& surfaces, const Lane& cosine, const Vec3& light,
                 TileVectors& colours) {
  HWY_DYNAMIC_DISPATCH(AddDiffuse)(lanes, surfaces, cosine, light, colours);
}
void mix(std::uint64_t lanes, const Vec3& base, const Vec3& share, const TileVectors& seen, TileVectors& colours) {
  HWY_DYNAMIC_DISPATCH(Mix)(lanes, base, share, seen, colours);
}
void srgb_bytes(const TileVectors& colours, TileBytes& bytes) {
  static const ByteTable table;
  HWY_DYNAMIC_DISPATCH(SrgbBytes)(table, colours, bytes);
}
std::string instruction_set() { return HWY_DYNAMIC_DISPATCH(InstructionSet)(); }

}  // namespace twocone::sim_povray
#endif  // HWY_ONCE

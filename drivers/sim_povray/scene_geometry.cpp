// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/render/native/pigment_colour.h"
#include "drivers/sim_povray/render/native/tile_tracer.h"
#include "drivers/sim_povray/render/native/traced_scene.h"
#include "drivers/sim_povray/scene/evaluator.h"

namespace twocone::sim_povray {
namespace {

/// Samples per pixel side of the overhead image. A tile of rays holds kSamples x kSamples samples of kTilePixels pixels
/// a side.
constexpr int kSamples = 2;
constexpr int kTilePixels = 4;
static_assert(kSamples * kTilePixels * kSamples * kTilePixels == kTileRays);
/// The colour of what the overhead view cuts, linear light: near black, so that it is no colour of a lit surface.
constexpr Colour kCut{0.03, 0.03, 0.035};
/// The places at which overhead() looks for objects that are air: each side of a grid.
constexpr int kAirGrid = 16;
/// A cylinder is upright if its axis leans by less: a micrometre in a metre, many times what rounding does to a chain
/// of transformations.
constexpr double kUpright = 1e-6;

/// The index of the pose of what is not still.
constexpr int kNotStill = 0;

bool is_still(const Object& object) {
  return !(object.name == "robot" || object.name.starts_with("robot.") || object.name.starts_with("moving."));
}

/// Returns the text with blanks for the named cameras, which may be of a kind that the evaluator does not know.
std::string without_cameras(std::string text) {
  for (const NamedBlock& block : outline(text).blocks) {
    if (block.keyword != "camera") continue;
    std::replace_if(
        text.begin() + std::ptrdiff_t(block.begin), text.begin() + std::ptrdiff_t(block.close) + 1,
        [](char letter) { return letter != '\n'; }, ' ');
  }
  return text;
}

std::array<double, 3> as_array(const Colour& colour) { return {colour.x, colour.y, colour.z}; }

}  // namespace

std::string SceneObject::describe() const { return fmt::format("{} of {}:{}", kind, file, line); }

struct SceneGeometry::Content {
  Content(EvaluatedScene evaluated, double unit) : scene(std::move(evaluated)), unit_m(unit) {
    poses.movers.resize(kNotStill + 1);
    for (const TracedScene::Source& source : scene.sources()) {
      objects.push_back({source.kind, source.name, *source.file, source.line});
    }
    const auto& groups = scene.groups();
    for (std::size_t i = 0; i < groups.size() && i < kGroupBits; ++i) {
      if (groups[i].mover != -1) still &= ~(GroupSet{1} << i);
    }
  }

  [[nodiscard]] Vec3 to_scene(const WorldVector& p) const { return Vec3{p[0], p[2], p[1]} / unit_m; }
  [[nodiscard]] bool is_inside(const TracedScene::Item& item, const Vec3& p) const {
    const auto bounds = item.solid.bounds();
    const bool may_be = !bounds || (p.x >= bounds->low.x && p.x <= bounds->high.x && p.y >= bounds->low.y &&
                                    p.y <= bounds->high.y && p.z >= bounds->low.z && p.z <= bounds->high.z);
    return may_be && item.solid.contains(p);
  }

  TracedScene scene;
  double unit_m;
  Poses poses{};
  GroupSet still = kAllGroups;
  std::vector<SceneObject> objects{};
};

Result<SceneGeometry> SceneGeometry::read(const PlaceSettings& place) {
  check(place);
  const auto text = Scene::read(place.scene);
  if (!text) return text.error();
  SceneAccess access(place.scene, place.scene_paths);
  const auto choice = choose_rendering(*text, place.switches, access);
  if (!choice) return choice.error();
  auto scene = evaluate(without_cameras(choice->scene.text()), choice->scene.path(), include_reader(access), {});
  if (!scene) return scene.error();
  for (Object& object : scene->objects) object.mover = is_still(object) ? -1 : kNotStill;
  return SceneGeometry(std::make_shared<const Content>(*std::move(scene), place.unit_m));
}

const std::vector<SceneObject>& SceneGeometry::objects() const { return content_->objects; }

std::optional<SurfacePoint> SceneGeometry::cast(const WorldVector& origin, const WorldVector& direction,
                                                double farthest_m) const {
  const Content& in = *content_;
  const Ray ray{in.to_scene(origin), {direction[0], direction[2], direction[1]}};
  const auto meeting = nearest(in.scene, in.poses, ray, RayKind::kReflected, in.still, farthest_m / in.unit_m);
  if (!meeting) return std::nullopt;
  return SurfacePoint{meeting->t * in.unit_m,
                      as_array(pigment_colour(meeting->texture->pigment, meeting->pattern_point)), meeting->number};
}

std::vector<int> SceneGeometry::around(const WorldVector& point) const {
  const Vec3 p = content_->to_scene(point);
  std::vector<int> found;
  for (const TracedScene::Group& group : content_->scene.groups()) {
    if (group.mover != -1) continue;
    for (const TracedScene::Item& item : group.items) {
      if (item.in_reflection && content_->is_inside(item, p)) found.push_back(item.number);
    }
  }
  return found;
}

std::vector<SceneCylinder> SceneGeometry::upright_cylinders() const {
  const Content& in = *content_;
  std::vector<SceneCylinder> found;
  int number = 0;
  // Items are numbered in the order in which unions are taken apart, as TracedScene does.
  const auto visit = [&](const auto& self, const Object& object, const Texture* texture, int mover) -> void {
    if (object.texture) texture = object.texture.get();
    const auto* csg = std::get_if<Csg>(&object.shape);
    if (csg != nullptr && csg->combination == Combination::kUnion && !object.inverse && object.clipped_by.empty()) {
      for (const Object& part : csg->parts) self(self, part, texture, mover);
      return;
    }
    const int index = number++;
    const auto* cone = std::get_if<Cone>(&object.shape);
    if (cone == nullptr || mover != -1 || cone->base_radius != cone->cap_radius || object.inverse ||
        object.no_reflection || !object.clipped_by.empty() || texture == nullptr) {
      return;
    }
    const Vec3 base = object.placed.point(cone->base);
    const Vec3 cap = object.placed.point(cone->cap);
    const Vec3 axis = cap - base;
    if (!(std::hypot(axis.x, axis.z) <= kUpright * std::abs(axis.y))) return;
    // The radius along x and along z, of a vector at right angles to the cylinder's own axis.
    const Vec3 own = normalized(cone->cap - cone->base);
    const Vec3 across = normalized(cross(own, std::abs(own.x) < 0.5 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
    const double first = length(object.placed.direction(across * cone->base_radius));
    const double second = length(object.placed.direction(cross(own, across) * cone->base_radius));
    if (!(std::abs(first - second) <= kUpright * first)) return;
    const Vec3 middle = (base + cap) / 2;
    const Vec3 side = middle + Vec3{first, 0, 0};
    found.push_back({middle.x * in.unit_m, middle.z * in.unit_m, first * in.unit_m, std::min(base.y, cap.y) * in.unit_m,
                     std::max(base.y, cap.y) * in.unit_m, as_array(pigment_colour(texture->pigment, side)), index});
  };
  for (const Object& object : in.scene.scene().objects) visit(visit, object, nullptr, object.mover);
  return found;
}

Image SceneGeometry::overhead(const OverheadView& view) const {
  const Content& in = *content_;
  const int height_px = checked_height_px(view, in.unit_m);
  const int width_px = view.width_px;
  const double high = view.height_m / in.unit_m;
  const auto point_at = [&](double column, double row) {
    const double x = view.min_x_m + (view.max_x_m - view.min_x_m) * column / width_px;
    const double y = view.max_y_m - (view.max_y_m - view.min_y_m) * row / height_px;
    return Vec3{x / in.unit_m, high, y / in.unit_m};
  };
  // What the view cuts. An object that has most of the plane inside is a room's shell or the ground below it.
  std::vector<const TracedScene::Item*> cut;
  for (const TracedScene::Group& group : in.scene.groups()) {
    for (const TracedScene::Item& item : group.items) {
      const auto bounds = item.solid.bounds();
      if (group.mover != -1 || !item.in_image || (bounds && (bounds->low.y > high || bounds->high.y < high))) continue;
      int inside = 0;
      for (int i = 0; i < kAirGrid * kAirGrid; ++i) {
        const int row = i / kAirGrid;
        const Vec3 p = point_at((i % kAirGrid + 0.5) * width_px / kAirGrid, (row + 0.5) * height_px / kAirGrid);
        inside += in.is_inside(item, p) ? 1 : 0;
      }
      if (inside <= kAirGrid * kAirGrid / 2) cut.push_back(&item);
    }
  }
  const auto is_cut = [&](const Vec3& p) {
    return std::ranges::any_of(cut, [&](const TracedScene::Item* item) { return in.is_inside(*item, p); });
  };

  Image image{width_px, height_px, PixelFormat::kRgb8,
              Bytes(std::vector<std::uint8_t>(3 * std::size_t(width_px) * std::size_t(height_px)))};
  std::uint8_t* const bytes = image.bytes.data();
  auto bundle = std::make_unique<RayBundle>();
  auto seen = std::make_unique<SeenTile>();
  auto means = std::make_unique<TileVectors>();
  TileBytes means_bytes;
  const PosedScene posed(in.scene, in.poses);
  const Vec3 down{0, -1, 0};
  constexpr int kSide = kSamples * kTilePixels;
  bundle->used = ~std::uint64_t{0};
  Lane weights;
  weights.fill(1);
  for (int top = 0; top < height_px; top += kTilePixels) {
    for (int left = 0; left < width_px; left += kTilePixels) {
      for (int lane = 0; lane < kTileRays; ++lane) {
        const int row = lane / kSide;
        bundle->rays.origin.set(lane, point_at(left + (lane % kSide + 0.5) / kSamples, top + (row + 0.5) / kSamples));
        bundle->rays.direction.set(lane, down);
      }
      bundle->t_max.fill(kInfinity);
      fill_unused(*bundle);
      trace_tile(posed, *bundle, 1, kAllGroups, weights, *seen);
      for (int y = top; y < std::min(top + kTilePixels, height_px); ++y) {
        for (int x = left; x < std::min(left + kTilePixels, width_px); ++x) {
          Colour sum;
          for (int sample = 0; sample < kSamples * kSamples; ++sample) {
            const int lane =
                ((y - top) * kSamples + sample / kSamples) * kSide + (x - left) * kSamples + sample % kSamples;
            sum += is_cut(bundle->rays.origin.at(lane)) ? kCut : seen->colours.at(lane);
          }
          means->set((y - top) * kTilePixels + x - left, sum / (kSamples * kSamples));
        }
      }
      srgb_bytes(*means, means_bytes);
      for (int y = top; y < std::min(top + kTilePixels, height_px); ++y) {
        std::copy_n(means_bytes.begin() + std::ptrdiff_t{3} * kTilePixels * (y - top),
                    3 * std::min(kTilePixels, width_px - left),
                    bytes + 3 * (std::size_t(y) * std::size_t(width_px) + std::size_t(left)));
      }
    }
  }
  return image;
}

}  // namespace twocone::sim_povray

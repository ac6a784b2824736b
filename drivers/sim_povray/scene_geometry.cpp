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
/// A cylinder is upright and round if it is so to this share: a micrometre in a metre, many times what rounding does to
/// a chain of transformations.
constexpr double kUpright = 1e-6;
/// Heights at which cells_of() looks for what crosses the cell.
constexpr int kLevels = 8;
/// What ends at the lower height of cells_of() is not above it, whatever rounding does.
constexpr double kAboveLow_m = 1e-6;

/// The index of the pose of what is not still.
constexpr int kNotStill = 0;

bool is_still(const Object& object) {
  return !(object.name == "robot" || object.name.starts_with("robot.") || object.name.starts_with("moving."));
}

/// Returns the scene's text with blanks for the named blocks that `is_left_out` chooses. They have no obstacle.
template <class IsLeftOut>
std::string without_blocks(const Scene& scene, IsLeftOut is_left_out) {
  std::string text = scene.text();
  for (const NamedBlock& block : scene.blocks()) {
    if (!is_left_out(block)) continue;
    std::replace_if(
        text.begin() + std::ptrdiff_t(block.begin), text.begin() + std::ptrdiff_t(block.close) + 1,
        [](char letter) { return letter != '\n'; }, ' ');
  }
  return text;
}

bool is_of_robot(const NamedBlock& block) {
  const std::string kind = block.name.substr(0, block.name.find('.'));
  return kind == "robot" || kind == "lower" || kind == "upper";
}

Rgb as_rgb(const Colour& colour) { return {colour.x, colour.y, colour.z}; }

/// Returns whether the pigment has a colour everywhere: a lenient evaluation leaves out what it does not understand.
bool is_understood(const Pigment& pigment) { return pigment.pattern != Pattern::kColour || !pigment.entries.empty(); }

/// Returns the pigment's colour, if it is one.
std::optional<Rgb> plain_colour(const Texture* texture) {
  if (texture == nullptr || texture->pigment.pattern != Pattern::kColour) return std::nullopt;
  const auto& entries = texture->pigment.entries;
  if (entries.size() != 1 || entries.front().pigment != nullptr) return std::nullopt;
  return as_rgb(entries.front().colour);
}

void collect(const Pigment& pigment, std::vector<Rgb>& colours) {
  for (const PigmentEntry& entry : pigment.entries) {
    if (entry.pigment != nullptr) {
      collect(*entry.pigment, colours);
    } else {
      colours.push_back(as_rgb(entry.colour));
    }
  }
}

void collect(const Object& object, std::vector<Rgb>& colours) {
  if (object.texture != nullptr) collect(object.texture->pigment, colours);
  if (const auto* csg = std::get_if<Csg>(&object.shape)) {
    for (const Object& part : csg->parts) collect(part, colours);
  }
}

bool is_inside(const TracedScene::Item& item, const Vec3& p) {
  const auto bounds = item.solid.bounds();
  return (!bounds || is_within(p, *bounds)) && item.solid.contains(p);
}

/// Returns the object as an upright cylinder in the scene's coordinates, y up, without its colour.
std::optional<SceneCylinder> as_cylinder(const Object& object) {
  const auto* cone = std::get_if<Cone>(&object.shape);
  if (cone == nullptr || cone->open || cone->base_radius != cone->cap_radius || object.inverse || object.is_bound ||
      !object.clipped_by.empty()) {
    return std::nullopt;
  }
  // Two radii at right angles to its axis and to each other.
  const Vec3 axis = normalized(cone->cap - cone->base);
  const Vec3 across = normalized(cross(axis, std::abs(axis.x) < 0.5 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
  const Vec3 a = object.placed.direction(across * cone->base_radius);
  const Vec3 b = object.placed.direction(cross(axis, across) * cone->base_radius);
  const double radius = length(a);
  const auto is_small = [&](double value) { return std::abs(value) <= kUpright * radius; };
  const Vec3 base = object.placed.point(cone->base);
  const Vec3 cap = object.placed.point(cone->cap);
  if (!is_small(a.y) || !is_small(b.y) || !is_small(length(b) - radius) || !is_small(dot(a, b) / radius) ||
      std::hypot(cap.x - base.x, cap.z - base.z) > kUpright * std::abs(cap.y - base.y)) {
    return std::nullopt;
  }
  return SceneCylinder{(base.x + cap.x) / 2, (base.z + cap.z) / 2, radius, std::min(base.y, cap.y),
                       std::max(base.y, cap.y)};
}

}  // namespace

std::string SceneObject::place() const { return fmt::format("{}:{}", file, line); }
std::string SceneObject::describe() const { return fmt::format("{} of {}", kind, place()); }

FloorPoint FloorGrid::centre(std::size_t cell) const {
  const std::size_t row = cell / std::size_t(columns);
  const std::size_t column = cell % std::size_t(columns);
  return {corner.x_m + cell_m * (double(column) + 0.5), corner.y_m + cell_m * (double(row) + 0.5)};
}

struct SceneGeometry::Content {
  explicit Content(EvaluatedScene evaluated) : scene(std::move(evaluated)) {
    poses.movers.resize(kNotStill + 1);
    for (std::size_t i = 0; i < scene.sources().size(); ++i) {
      const TracedScene::Source& source = scene.sources()[i];
      const auto group = std::size_t(scene.place(int(i)).group);
      const bool is_still = scene.groups()[group].mover == -1;
      if (!is_still && group < kGroupBits) still &= ~(GroupSet{1} << group);
      objects.push_back({source.kind, *source.file, source.line, is_still && item(int(i)).in_reflection});
    }
  }

  [[nodiscard]] const TracedScene::Item& item(int number) const {
    const auto [group, index] = scene.place(number);
    return scene.groups()[std::size_t(group)].items[std::size_t(index)];
  }

  TracedScene scene;
  Poses poses{};
  GroupSet still = kAllGroups;
  std::vector<SceneObject> objects{};
};

Result<SceneGeometry> SceneGeometry::read(const PlaceSettings& place, Leniency* leniency) {
  check(place);
  const auto text = Scene::read(place.scene);
  if (!text) return text.error();
  SceneAccess access(place.scene, place.scene_paths);
  const auto choice = choose_rendering(*text, place.switches, access);
  if (!choice) return choice.error();
  // The robot's cameras may be of a kind that the evaluator does not know.
  const std::string seen = without_blocks(choice->scene, [&](const NamedBlock& block) {
    return leniency == nullptr && block.keyword == "camera" && block.obstacle.empty();
  });
  auto scene = evaluate(seen, choice->scene.path(), include_reader(access), {.leniency = leniency});
  if (!scene) return scene.error();
  for (Object& object : scene->objects) object.mover = is_still(object) ? -1 : kNotStill;
  return SceneGeometry(std::make_shared<const Content>(*std::move(scene)), place.unit_m, 0);
}

SceneGeometry SceneGeometry::in_frame(double unit_m, double floor_units) const {
  return {content_, unit_m, floor_units};
}

Vec3 SceneGeometry::to_scene(const Vec3& p) const { return Vec3{p.x, p.z, p.y} / unit_m_ + Vec3{0, floor_units_, 0}; }
Vec3 SceneGeometry::to_world(const Vec3& p) const { return Vec3{p.x, p.z, p.y - floor_units_} * unit_m_; }

const std::vector<SceneObject>& SceneGeometry::objects() const { return content_->objects; }

std::optional<Bounds3> SceneGeometry::bounds(int object) const {
  const auto bounds = content_->item(object).solid.bounds();
  if (!bounds) return std::nullopt;
  return Bounds3{to_world(bounds->low), to_world(bounds->high)};
}

std::optional<SurfacePoint> SceneGeometry::cast(const Vec3& origin, const Vec3& direction, double farthest_m) const {
  const Content& in = *content_;
  const Ray ray{to_scene(origin), {direction.x, direction.z, direction.y}};
  const auto met = nearest(in.scene, in.poses, ray, RayKind::kReflected, in.still, farthest_m / unit_m_);
  if (!met) return std::nullopt;
  const Pigment& pigment = met->texture->pigment;
  return SurfacePoint{met->t * unit_m_,
                      to_world(met->point),
                      {met->normal.x, met->normal.z, met->normal.y},
                      is_understood(pigment) ? as_rgb(pigment_colour(pigment, met->pattern_point)) : Rgb{},
                      met->number};
}

bool SceneGeometry::contains(int object, const Vec3& point) const {
  return is_inside(content_->item(object), to_scene(point));
}

std::vector<std::uint8_t> SceneGeometry::cells_of(int object, const FloorGrid& grid, double low_m, double high_m,
                                                  const Vec3& air) const {
  const TracedSolid& solid = content_->item(object).solid;
  const auto box = bounds(object);
  const double side = grid.cell_m;
  std::vector<std::uint8_t> cells(grid.size());
  low_m += kAboveLow_m;
  if (box && (box->high.z <= low_m || box->low.z >= high_m)) return cells;
  const bool is_filled = box && !contains(object, air);
  const bool is_small = box && box->high.x - box->low.x <= 2 * side && box->high.y - box->low.y <= 2 * side;
  const auto is_there = [&](double x_m, double y_m) {
    const auto at = [&](double x, double y, double z_m) { return to_scene({x_m + side * x, y_m + side * y, z_m}); };
    const auto crosses = [&](const Vec3& a, const Vec3& b) { return solid.blocks({a, b - a}, 0, 1); };
    for (int level = 0; level < kLevels; ++level) {
      const double z_m = low_m + (high_m - low_m) * level / (kLevels - 1);
      if (is_filled && solid.contains(at(0, 0, z_m))) return true;
      // The diagonals cross every wall through the cell but one that cuts off a corner.
      if (crosses(at(-0.5, -0.5, z_m), at(0.5, 0.5, z_m)) || crosses(at(-0.5, 0.5, z_m), at(0.5, -0.5, z_m)))
        return true;
    }
    for (const double x : {-0.5, -0.17, 0.17, 0.5}) {
      for (const double y : {-0.5, -0.17, 0.17, 0.5}) {
        if (crosses(at(x, y, low_m), at(x, y, high_m))) return true;
      }
    }
    return false;
  };
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto [x_m, y_m] = grid.centre(i);
    const bool may_be = !box || (x_m + side / 2 >= box->low.x && x_m - side / 2 <= box->high.x &&
                                 y_m + side / 2 >= box->low.y && y_m - side / 2 <= box->high.y);
    if (may_be && (is_small || is_there(x_m, y_m))) cells[i] = 255;
  }
  return cells;
}

std::vector<SceneCylinder> SceneGeometry::upright_cylinders() const {
  std::vector<SceneCylinder> found;
  int number = 0;
  // Objects are numbered in the order in which unions are taken apart, as TracedScene does.
  const auto visit = [&](const auto& self, const Object& object, const Texture* texture) -> void {
    if (object.texture) texture = object.texture.get();
    const auto* csg = std::get_if<Csg>(&object.shape);
    if (csg != nullptr && csg->combination == Combination::kUnion && !object.inverse && object.clipped_by.empty()) {
      for (const Object& part : csg->parts) self(self, part, texture);
      return;
    }
    const int index = number++;
    const auto cylinder = as_cylinder(object);
    if (!cylinder || !objects()[std::size_t(index)].is_still) return;
    const auto& [x, z, radius, low, high, no_colour, no_object] = *cylinder;
    const Vec3 bottom = to_world({x, low, z});
    found.push_back(
        {bottom.x, bottom.y, radius * unit_m_, bottom.z, to_world({x, high, z}).z, plain_colour(texture), index});
  };
  for (const Object& object : content_->scene.scene().objects) visit(visit, object, nullptr);
  return found;
}

std::optional<PerspectiveCamera> SceneGeometry::camera() const {
  std::optional<PerspectiveCamera> camera = content_->scene.scene().camera;
  if (!camera) return std::nullopt;
  camera->location = to_world(camera->location);
  for (Vec3* vector : {&camera->direction, &camera->right, &camera->up}) std::swap(vector->y, vector->z);
  return camera;
}

std::vector<Rgb> SceneGeometry::colours() const {
  std::vector<Rgb> colours;
  for (const Object& object : content_->scene.scene().objects) {
    if (object.mover == -1) collect(object, colours);
  }
  return colours;
}

std::vector<Rgb> SceneGeometry::sky_colours() const {
  std::vector<Rgb> colours{as_rgb(content_->scene.scene().background)};
  if (content_->scene.scene().sky) collect(*content_->scene.scene().sky, colours);
  return colours;
}

Image SceneGeometry::overhead(const OverheadView& view) const {
  const Content& in = *content_;
  const int height_px = checked_height_px(view, unit_m_);
  const int width_px = view.width_px;
  const auto point_at = [&](double column, double row) {
    const double x = view.min_x_m + (view.max_x_m - view.min_x_m) * column / width_px;
    const double y = view.max_y_m - (view.max_y_m - view.min_y_m) * row / height_px;
    return to_scene({x, y, view.height_m});
  };
  const double high = point_at(0, 0).y;
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
        inside += is_inside(item, p) ? 1 : 0;
      }
      if (inside <= kAirGrid * kAirGrid / 2) cut.push_back(&item);
    }
  }
  const auto is_cut = [&](const Vec3& p) {
    return std::ranges::any_of(cut, [&](const TracedScene::Item* item) { return is_inside(*item, p); });
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

Result<std::string> text_without_robot(const std::filesystem::path& scene) {
  const auto read = Scene::read(scene);
  if (!read) return read.error();
  bool has_robot = false;
  for (const NamedBlock& block : read->blocks()) {
    if (!is_of_robot(block)) continue;
    has_robot = true;
    if (block.obstacle.empty()) continue;
    return Error(ErrorCode::kRefused, "{}:{}: '{}' must stand at the top level of the file to be left out, and {}",
                 scene.string(), block.place.line, block.name, block.obstacle);
  }
  return has_robot ? without_blocks(*read, is_of_robot) : std::string();
}

}  // namespace twocone::sim_povray

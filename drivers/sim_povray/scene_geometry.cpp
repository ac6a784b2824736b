// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene_geometry.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/render/native/traced_scene.h"
#include "drivers/sim_povray/render/povray/scene_access.h"
#include "drivers/sim_povray/scene/evaluator.h"
#include "drivers/sim_povray/scene/scene.h"

namespace twocone::sim_povray {
namespace {

/// Scenes turn by degrees and scale by decimal fractions: an axis is vertical and a section round to within rounding.
constexpr double kRounding = 1e-9;

/// Returns the pigment's colour, if it is one.
std::optional<Colour> plain_colour(const Texture* texture) {
  if (texture == nullptr || texture->pigment.pattern != Pattern::kColour) return std::nullopt;
  const auto& entries = texture->pigment.entries;
  if (entries.size() != 1 || entries.front().pigment != nullptr) return std::nullopt;
  return entries.front().colour;
}

void collect(const Pigment& pigment, std::vector<Colour>& colours) {
  for (const PigmentEntry& entry : pigment.entries) {
    if (entry.pigment != nullptr) {
      collect(*entry.pigment, colours);
    } else {
      colours.push_back(entry.colour);
    }
  }
}

void collect(const Object& object, std::vector<Colour>& colours) {
  if (object.texture != nullptr) collect(object.texture->pigment, colours);
  if (const auto* csg = std::get_if<Csg>(&object.shape)) {
    for (const Object& part : csg->parts) collect(part, colours);
  }
}

/// Finds the cylinders in the order in which TracedScene takes unions apart.
class CylinderFinder {
 public:
  std::vector<SceneGeometry::UprightCylinder> found;

  void search(const Object& object, const Texture* texture) {
    if (object.texture != nullptr) texture = object.texture.get();
    const auto* csg = std::get_if<Csg>(&object.shape);
    if (csg != nullptr && csg->combination == Combination::kUnion && !object.inverse && object.clipped_by.empty()) {
      for (const Object& part : csg->parts) search(part, texture);
      return;
    }
    const std::size_t solid = next_++;
    const auto* cone = std::get_if<Cone>(&object.shape);
    if (cone == nullptr || cone->open || cone->base_radius != cone->cap_radius) return;
    if (object.inverse || !object.clipped_by.empty()) return;
    const Vec3 axis = normalized(cone->cap - cone->base);
    const Vec3 across = normalized(std::abs(axis.x) < 0.5 ? cross(axis, {1, 0, 0}) : cross(axis, {0, 1, 0}));
    const Vec3 a = object.placed.direction(across);
    const Vec3 b = object.placed.direction(cross(axis, across));
    const double scale = length(a);
    const auto is_small = [&](double value) { return std::abs(value) <= kRounding * scale; };
    if (!is_small(a.y) || !is_small(b.y) || !is_small(length(b) - scale) || !is_small(dot(a, b) / scale)) return;
    Vec3 low = object.placed.point(cone->base);
    Vec3 high = object.placed.point(cone->cap);
    if (low.y > high.y) std::swap(low, high);
    if (std::hypot(high.x - low.x, high.z - low.z) > kRounding * (high.y - low.y)) return;
    found.push_back({solid, low, scale * cone->base_radius, high.y - low.y, plain_colour(texture)});
  }

 private:
  std::size_t next_ = 0;
};

}  // namespace

Result<std::string> text_without_robot(const std::filesystem::path& scene) {
  const auto read = Scene::read(scene);
  if (!read) return read.error();
  std::string text = read->text();
  bool has_robot = false;
  for (const NamedBlock& block : outline(text).blocks) {
    const std::string kind = block.name.substr(0, block.name.find('.'));
    if (kind != "robot" && kind != "lower" && kind != "upper") continue;
    has_robot = true;
    std::replace_if(
        text.begin() + std::ptrdiff_t(block.begin), text.begin() + std::ptrdiff_t(block.close) + 1,
        [](char letter) { return letter != '\n'; }, ' ');
  }
  return has_robot ? text : std::string();
}

SceneGeometry::SceneGeometry(SceneGeometry&&) noexcept = default;
SceneGeometry& SceneGeometry::operator=(SceneGeometry&&) noexcept = default;
SceneGeometry::~SceneGeometry() = default;

Result<SceneGeometry> SceneGeometry::read(const std::filesystem::path& scene,
                                          const std::vector<std::filesystem::path>& scene_paths) {
  const auto text = Scene::read(scene);
  if (!text) return text.error();
  SceneAccess access(scene, scene_paths);
  Leniency leniency;
  EvaluatorSettings settings;
  settings.leniency = &leniency;
  auto evaluated = evaluate(text->text(), scene.string(), include_reader(access), settings);
  if (!evaluated) return evaluated.error();
  std::erase_if(evaluated->objects,
                [](const Object& object) { return object.name == "robot" || object.name.starts_with("robot."); });
  // The geometry stands still.
  for (Object& object : evaluated->objects) object.mover = -1;
  SceneGeometry geometry(*std::move(evaluated));
  geometry.left_out_ = std::move(leniency.left_out);
  geometry.bounded_ = std::move(leniency.bounded);
  return geometry;
}

SceneGeometry::SceneGeometry(EvaluatedScene scene) : scene_(std::make_unique<const TracedScene>(std::move(scene))) {
  for (const TracedScene::Source& source : scene_->sources()) {
    solids_.push_back({source.kind, fmt::format("{}:{}", *source.file, source.line), {}});
  }
  for (const TracedScene::Group& group : scene_->groups()) {
    for (const TracedScene::Item& item : group.items) solids_[std::size_t(item.number)].bounds = item.solid.bounds();
  }
  CylinderFinder finder;
  for (const Object& object : scene_->scene().objects) finder.search(object, nullptr);
  cylinders_ = std::move(finder.found);
}

std::optional<SceneGeometry::Surface> SceneGeometry::nearest(const Vec3& origin, const Vec3& direction,
                                                             double most) const {
  const auto met = sim_povray::nearest(*scene_, {}, {origin, direction}, RayKind::kReflected, kAllGroups, most);
  if (!met) return std::nullopt;
  return Surface{met->point, met->normal, std::size_t(met->number)};
}

bool SceneGeometry::crosses(std::size_t solid, const Vec3& a, const Vec3& b) const {
  const auto [group, item] = scene_->place(int(solid));
  return scene_->groups()[std::size_t(group)].items[std::size_t(item)].solid.blocks({a, b - a}, 0, 1);
}

bool SceneGeometry::contains(std::size_t solid, const Vec3& point) const {
  const auto [group, item] = scene_->place(int(solid));
  return scene_->groups()[std::size_t(group)].items[std::size_t(item)].solid.contains(point);
}

const std::optional<PerspectiveCamera>& SceneGeometry::camera() const { return scene_->scene().camera; }

std::vector<Colour> SceneGeometry::colours() const {
  std::vector<Colour> colours;
  for (const Object& object : scene_->scene().objects) collect(object, colours);
  return colours;
}

std::vector<Colour> SceneGeometry::sky_colours() const {
  std::vector<Colour> colours{scene_->scene().background};
  if (scene_->scene().sky) collect(*scene_->scene().sky, colours);
  return colours;
}

}  // namespace twocone::sim_povray

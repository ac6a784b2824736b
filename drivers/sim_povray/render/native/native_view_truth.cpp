// SPDX-License-Identifier: Apache-2.0
// What the pixels of a view really show.
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "drivers/sim_povray/render/native/native_view.h"
#include "drivers/sim_povray/scene/evaluator.h"

namespace twocone::sim_povray {

void NativeView::plan_truth() const {
  TruthPlan& plan = truth_plan_;
  auto objects = std::make_shared<std::vector<TrueObject>>();
  const auto to_world_m = [this](const Vec3& p) { return std::array{p.x * unit_m_, p.z * unit_m_, p.y * unit_m_}; };
  for (const TracedScene::Source& source : scene_.sources()) {
    const auto [group_index, item_index] = scene_.place(int(plan.numbers.size()));
    const TracedScene::Group& group = scene_.groups()[std::size_t(group_index)];
    // Only the mask of the pixels outside the mirror moves with the view.
    const bool is_mask = group.mover == kViewMover;
    plan.numbers.push_back(is_mask ? std::uint16_t{0} : static_cast<std::uint16_t>(objects->size() + 1));
    if (is_mask) continue;
    TrueObject object{plan.numbers.back(), source.kind, source.name, *source.file, source.line, {}};
    const auto bounds = group.items[std::size_t(item_index)].solid.bounds();
    if (bounds && group.mover == -1) object.box = TrueBox{to_world_m(bounds->low), to_world_m(bounds->high)};
    objects->push_back(std::move(object));
  }
  plan.is_too_large = objects->size() > std::numeric_limits<std::uint16_t>::max();
  plan.objects = std::move(objects);
  plan.fixed.resize(fixed_.size());
  if (tiles_.empty()) return;
  Poses rest;
  rest.movers.resize(std::size_t(robot_) + 1);
  for (int y = window_.first_row; y <= window_.last_row; ++y) {
    for (int x = window_.first_column; x <= window_.last_column; ++x) {
      const FixedPixel& pixel = fixed_[pixel_index(x, y)];
      if (pixel.kind == FixedPixel::Kind::kAny) continue;
      const Ray ray = camera_ray(centre_of(x, y));
      const auto meeting = nearest(scene_, rest, ray, RayKind::kFromCamera, own_);
      if (!meeting || (pixel.kind == FixedPixel::Kind::kMirror && is_own_mirror(meeting->number, *meeting->texture)))
        continue;
      plan.fixed[pixel_index(x, y)] = {meeting->number, meeting->t, against(meeting->normal, ray.direction)};
    }
  }
}

Result<PixelTruth> NativeView::empty_truth() const {
  std::call_once(truth_planned_, [this] { plan_truth(); });
  if (truth_plan_.is_too_large) {
    return Error(ErrorCode::kRefused, "the scene has {} objects, but only {} can be numbered in 16 bits",
                 truth_plan_.objects->size(), std::numeric_limits<std::uint16_t>::max());
  }
  const std::size_t pixels = std::size_t(width_px_) * std::size_t(height_px_);
  PixelTruth truth{.width_px = width_px_, .height_px = height_px_};
  truth.object.resize(pixels);
  truth.distance_m.resize(pixels);
  truth.normal.resize(pixels);
  truth.objects = truth_plan_.objects;
  return truth;
}

bool NativeView::is_own_mirror(int number, const Texture& texture) const {
  constexpr double kLeastShare = 0.5;
  const TracedScene::Group& group = scene_.groups()[std::size_t(scene_.place(number).group)];
  return robot_ >= 0 && group.mover == robot_ && greatest_component(texture.finish.reflection) >= kLeastShare;
}

void NativeView::set_truth(PixelTruth& truth, std::size_t pixel, int number, double distance,
                           const Vec3& normal) const {
  truth.object[pixel] = truth_plan_.numbers[std::size_t(number)];
  if (truth.object[pixel] == 0) return;
  truth.distance_m[pixel] = float(distance * unit_m_);
  truth.normal[pixel] = {float(normal.x), float(normal.z), float(normal.y)};
}

void NativeView::set_truth(PixelTruth& truth, std::size_t pixel, const SeenTile& given, int lane,
                           bool is_reflected) const {
  const SeenTile* seen = &given;
  const auto is_in = [lane](std::uint64_t lanes) { return (lanes >> lane & 1) != 0; };
  const auto i = std::size_t(lane);
  if (!is_in(seen->met)) return;
  if (!is_reflected && is_own_mirror(int(seen->hits->number[i]), *(*seen->textures)[i])) {
    if (!is_in(seen->mirrored)) return;
    seen = seen->reflected;
    if (!is_in(seen->met)) return;
  }
  set_truth(truth, pixel, int(seen->hits->number[i]), seen->hits->t[i], seen->normals->at(lane));
}

}  // namespace twocone::sim_povray

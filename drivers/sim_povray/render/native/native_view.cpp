// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/native_view.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "drivers/sim_povray/render/native/pigment_colour.h"
#include "drivers/sim_povray/render/native/shading.h"
#include "drivers/sim_povray/scene/evaluator.h"

namespace twocone::sim_povray {
namespace {

constexpr int kBandRows = 8;

/// Returns the smallest box around the image of a box.
Bounds3 moved(const Bounds3& box, const Transform& by, bool backwards) {
  Bounds3 result{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p{(corner & 1) != 0 ? box.high.x : box.low.x, (corner & 2) != 0 ? box.high.y : box.low.y,
                 (corner & 4) != 0 ? box.high.z : box.low.z};
    const Vec3 q = backwards ? by.inverse_point(p) : by.point(p);
    result = around(result, {q, q});
  }
  return result;
}

/// Returns whether light sources change what a surface shows.
bool needs_light(const Finish& finish) { return finish.diffuse > 0 || finish.phong > 0 || finish.specular > 0; }

}  // namespace

std::optional<Poses> parse_poses(std::string_view text) {
  std::vector<Transform> poses;
  constexpr std::string_view kMatrix = "matrix <";
  for (std::size_t at = text.find(kMatrix); at != std::string_view::npos; at = text.find(kMatrix)) {
    text.remove_prefix(at + kMatrix.size());
    std::array<double, 12> m{};
    for (double& number : m) {
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
      if (error != std::errc{} || end == text.data() + text.size()) return std::nullopt;
      text.remove_prefix(std::size_t(end - text.data()) + 1);  // with the comma or bracket after it
      while (text.starts_with(' ')) text.remove_prefix(1);
    }
    auto pose = Transform::matrix({Vec3{m[0], m[1], m[2]}, Vec3{m[3], m[4], m[5]}, Vec3{m[6], m[7], m[8]}},
                                  {m[9], m[10], m[11]});
    if (!pose) return std::nullopt;
    poses.push_back(*pose);
  }
  if (poses.empty()) return std::nullopt;
  Poses result{.view = poses.back()};
  poses.pop_back();
  result.movers = std::move(poses);
  return result;
}

Result<std::shared_ptr<const NativeView>> NativeView::make(const ViewTemplate& view_template, const std::string& path,
                                                           const IncludeReader& read) {
  auto scene = evaluate(view_template.scene, path, read,
                        {view_template.pose_prefix, view_template.width_px, view_template.height_px});
  if (!scene) return scene.error();
  if (!scene->camera) return Error(ErrorCode::kRefused, "{}: the scene has no camera", path);
  return std::shared_ptr<const NativeView>(new NativeView(*std::move(scene), view_template));
}

NativeView::NativeView(EvaluatedScene scene, const ViewTemplate& view_template)
    : scene_(std::move(scene)),
      width_px_(view_template.width_px),
      height_px_(view_template.height_px),
      window_(view_template.window.value_or(Window{0, width_px_ - 1, 0, height_px_ - 1})),
      robot_(view_template.carrier) {
  for (int row = window_.first_row; row <= window_.last_row; row += kBandRows) bands_.push_back(row);
  if (robot_ >= 0) plan();
}

Ray NativeView::camera_ray(double column, double row) const {
  const PerspectiveCamera& camera = *scene_.scene().camera;
  const double u = column / width_px_ - 0.5;
  const double v = 0.5 - row / height_px_;
  return {camera.location, normalized(camera.direction + camera.right * u + camera.up * v)};
}

void NativeView::plan() {
  const auto& groups = scene_.groups();
  for (std::size_t i = 0; i < std::min(groups.size(), kGroupBits); ++i) {
    if (groups[i].mover == robot_ || groups[i].mover == kViewMover) own_ |= GroupSet{1} << i;
  }
  const Vec3 eye = scene_.scene().camera->location;
  sight_ = {eye, eye};
  fixed_.resize(std::size_t(width_px_) * std::size_t(height_px_));
  for (int y = window_.first_row; y <= window_.last_row; ++y) {
    for (int x = window_.first_column; x <= window_.last_column; ++x) {
      fixed_[std::size_t(y) * std::size_t(width_px_) + std::size_t(x)] = fixed_pixel(camera_ray(x + 0.5, y + 0.5));
    }
  }
}

NativeView::FixedPixel NativeView::fixed_pixel(const Ray& ray) {
  const EvaluatedScene& description = scene_.scene();
  Poses rest;
  rest.movers.resize(std::size_t(robot_) + 1);
  FixedPixel pixel;
  const auto meeting = nearest(scene_, rest, ray, RayKind::kFromCamera, own_);
  if (!meeting) return pixel;
  const Finish& finish = meeting->texture->finish;
  if (needs_light(finish)) return pixel;
  pixel.colour =
      unlit(finish, pigment_colour(meeting->texture->pigment, meeting->pattern_point), description.ambient_light);
  pixel.kind = FixedPixel::Kind::kConstant;
  sight_ = around(sight_, {meeting->point, meeting->point});
  const Colour& share = finish.reflection;
  if (share == Colour{} || description.max_trace_level < 2 ||
      std::max({share.x, share.y, share.z}) < description.adc_bailout) {
    return pixel;
  }
  pixel.kind = FixedPixel::Kind::kMirror;
  pixel.share = share;
  const Vec3 normal = dot(meeting->normal, ray.direction) > 0 ? -meeting->normal : meeting->normal;
  pixel.reflected = {meeting->point, ray.direction - normal * (2 * dot(ray.direction, normal))};
  const auto own = nearest(scene_, rest, pixel.reflected, RayKind::kReflected, own_);
  pixel.meets_own = own.has_value();
  if (own) pixel.own_t = own->t;
  return pixel;
}

bool NativeView::is_view_clear(const Poses& poses) const {
  const Bounds3 sight = moved(sight_, poses.view, false);
  const auto& groups = scene_.groups();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (i < kGroupBits && (own_ >> i & 1) != 0) continue;
    const TracedScene::Group& group = groups[i];
    const Bounds3 box = group.mover == -1 ? sight : moved(sight, poses.of(group.mover), true);
    for (const TracedScene::Item& item : group.items) {
      if (item.in_image && item.solid.may_cross(box)) return false;
    }
  }
  return true;
}

void NativeView::render(const Poses& poses, int band, Image& image) const {
  const bool planned = robot_ >= 0 && std::size_t(robot_) < poses.movers.size() &&
                       poses.movers[std::size_t(robot_)] == poses.view && is_view_clear(poses);
  const int first = bands_[std::size_t(band)];
  const int last = std::min(first + kBandRows - 1, window_.last_row);
  for (int y = first; y <= last; ++y) {
    for (int x = window_.first_column; x <= window_.last_column; ++x) {
      const std::size_t index = std::size_t(y) * std::size_t(width_px_) + std::size_t(x);
      const FixedPixel kAny{};
      const FixedPixel& pixel = planned ? fixed_[index] : kAny;
      Colour colour = pixel.colour;
      if (pixel.kind == FixedPixel::Kind::kAny) {
        const Ray ray = camera_ray(x + 0.5, y + 0.5);
        const Ray moved_ray{poses.view.point(ray.origin), normalized(poses.view.direction(ray.direction))};
        colour = traced(scene_, poses, moved_ray, RayKind::kFromCamera, 1, 1);
      } else if (pixel.kind == FixedPixel::Kind::kMirror) {
        const Ray ray{poses.view.point(pixel.reflected.origin), poses.view.direction(pixel.reflected.direction)};
        const double weight = std::max({pixel.share.x, pixel.share.y, pixel.share.z});
        Colour seen;
        if (const auto meeting = nearest(scene_, poses, ray, RayKind::kReflected, ~own_, pixel.own_t)) {
          seen = shaded(scene_, poses, ray, *meeting, 2, weight);
        } else if (pixel.meets_own) {
          seen = traced(scene_, poses, ray, RayKind::kReflected, 2, weight);
        } else {
          seen = sky_colour(scene_.scene(), ray.direction);
        }
        colour += pixel.share * seen;
      }
      std::uint8_t* bytes = image.bytes.data() + 3 * index;
      bytes[0] = srgb_byte(colour.x);
      bytes[1] = srgb_byte(colour.y);
      bytes[2] = srgb_byte(colour.z);
    }
  }
}

}  // namespace twocone::sim_povray

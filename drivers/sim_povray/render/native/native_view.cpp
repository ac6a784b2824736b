// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/native_view.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <utility>

#include "drivers/sim_povray/render/native/pigment_colour.h"
#include "drivers/sim_povray/render/native/shading.h"
#include "drivers/sim_povray/scene/evaluator.h"

namespace twocone::sim_povray {

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
      antialias_(view_template.antialias),
      window_(view_template.window.value_or(Window{0, width_px_ - 1, 0, height_px_ - 1})),
      robot_(view_template.carrier),
      unit_m_(view_template.unit_m) {
  if (robot_ >= 0) plan();
}

NativeView::ImagePoint NativeView::sample_point(int x, int y, int number) const {
  const int column = number % antialias_;
  const int row = number / antialias_;
  return {x + (column + 0.5) / antialias_, y + (row + 0.5) / antialias_};
}

Ray NativeView::camera_ray(const ImagePoint& point) const {
  const PerspectiveCamera& camera = *scene_.scene().camera;
  const double u = point.column / width_px_ - 0.5;
  const double v = 0.5 - point.row / height_px_;
  return {camera.location, normalized(camera.direction + camera.right * u + camera.up * v)};
}

void NativeView::plan() {
  const auto& groups = scene_.groups();
  if (groups.size() > kGroupBits) return;  // those without a bit belong to every set, also to own_
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (groups[i].mover == robot_ || groups[i].mover == kViewMover) own_ |= GroupSet{1} << i;
  }
  const Vec3 eye = scene_.scene().camera->location;
  sight_ = {eye, eye};
  fixed_.resize(std::size_t(width_px_) * std::size_t(height_px_));
  for (int y = window_.first_row; y <= window_.last_row; y += kTileSide) {
    for (int x = window_.first_column; x <= window_.last_column; x += kTileSide) tiles_.push_back(fixed_tile(x, y));
  }
  const std::size_t samples = tiles_.size() * kTileRays * std::size_t(antialias_) * std::size_t(antialias_);
  constexpr std::size_t kMostSampleBytes = std::size_t{512} << 20;
  const bool is_kept = antialias_ > 1 && samples * sizeof(FixedSamples::Sample) <= kMostSampleBytes;
  if (is_kept) samples_ = std::vector<LazySamples>(tiles_.size());
}

NativeView::FixedTile NativeView::fixed_tile(int column, int row) {
  FixedTile tile;
  tile.surroundings = ~own_;
  const auto note = [](std::uint64_t& lanes, std::optional<FixedPixel>& common, int lane, const FixedPixel& pixel) {
    common = lanes == 0 || common == pixel ? std::optional(pixel) : std::nullopt;
    lanes |= std::uint64_t{1} << lane;
  };
  for (int lane = 0; lane < kTileRays; ++lane) {
    const int x = column + lane % kTileSide;
    const int y = row + lane / kTileSide;
    if (x > window_.last_column || y > window_.last_row) continue;
    FixedPixel& pixel = fixed_[pixel_index(x, y)];
    Ray reflected;
    bool meets_own = false;
    Vec3 end;
    pixel = fixed_pixel(camera_ray(centre_of(x, y)), reflected, meets_own, end);
    if (pixel.kind != FixedPixel::Kind::kAny) sight_ = around(sight_, {end, end});
    if (meets_own) tile.surroundings = kAllGroups;
    switch (pixel.kind) {
      case FixedPixel::Kind::kAny:
        tile.unknown |= std::uint64_t{1} << lane;
        break;
      case FixedPixel::Kind::kConstant:
        note(tile.constant, tile.common_constant, lane, pixel);
        break;
      case FixedPixel::Kind::kMirror:
        note(tile.mirror, tile.common_mirror, lane, pixel);
        tile.origin.set(lane, reflected.origin);
        tile.direction.set(lane, reflected.direction);
        break;
    }
  }
  if (tile.mirror == 0) return tile;
  const int any = std::countr_zero(tile.mirror);
  for_each_lane(~tile.mirror, [&](int lane) {
    tile.origin.set(lane, tile.origin.at(any));
    tile.direction.set(lane, tile.direction.at(any));
  });
  return tile;
}

NativeView::FixedPixel NativeView::fixed_pixel(const Ray& ray, Ray& reflected, bool& meets_own, Vec3& end) const {
  const EvaluatedScene& description = scene_.scene();
  Poses rest;
  rest.movers.resize(std::size_t(robot_) + 1);
  FixedPixel pixel;
  const auto meeting = nearest(scene_, rest, ray, RayKind::kFromCamera, own_);
  if (!meeting) return pixel;
  const Finish& finish = meeting->texture->finish;
  if (shows_light(finish)) return pixel;
  pixel.colour =
      unlit(finish, pigment_colour(meeting->texture->pigment, meeting->pattern_point), description.ambient_light);
  pixel.kind = FixedPixel::Kind::kConstant;
  end = meeting->point;
  const Colour& share = finish.reflection;
  if (share == Colour{} || description.max_trace_level < 2 || greatest_component(share) < description.adc_bailout) {
    return pixel;
  }
  pixel.kind = FixedPixel::Kind::kMirror;
  pixel.share = share;
  const Vec3 normal = against(meeting->normal, ray.direction);
  reflected = {meeting->point, ray.direction - normal * (2 * dot(ray.direction, normal))};
  meets_own = nearest(scene_, rest, reflected, RayKind::kReflected, own_).has_value();
  return pixel;
}

NativeView::Moment NativeView::at(Poses poses) const {
  const bool is_planned = is_plan_valid(poses);
  return {PosedScene(scene_, std::move(poses)), is_planned};
}

bool NativeView::is_plan_valid(const Poses& poses) const {
  if (tiles_.empty() || std::size_t(robot_) >= poses.movers.size()) return false;
  if (poses.movers[std::size_t(robot_)] != poses.view) return false;
  const Bounds3 sight = moved(sight_, poses.view);
  const auto& groups = scene_.groups();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if ((own_ >> i & 1) != 0) continue;
    const TracedScene::Group& group = groups[i];
    const Bounds3 box = group.mover == -1 ? sight : moved(sight, poses.of(group.mover).inverse());
    for (const TracedScene::Item& item : group.items) {
      if (item.in_image && item.solid.may_cross(box)) return false;
    }
  }
  return true;
}

int NativeView::bands() const { return (window_.last_row - window_.first_row) / kBlock_px + 1; }

std::pair<int, int> NativeView::bands_of(const RowRange& rows) const {
  const auto band_of = [this](int row) { return std::clamp((row - window_.first_row) / kBlock_px, 0, bands() - 1); };
  return {band_of(rows.first), band_of(rows.last) + 1};
}

std::size_t NativeView::mirror_pixels() const {
  return std::size_t(std::ranges::count(fixed_, FixedPixel::Kind::kMirror, &FixedPixel::kind));
}

void NativeView::tile_centres(const Moment& moment, int column, int row, std::uint64_t inside, TileVectors& tile,
                              PixelTruth* truth) const {
  std::uint64_t unknown = inside;
  if (moment.is_planned) {
    const FixedTile& fixed = fixed_tile_at(column, row);
    unknown &= fixed.unknown;
    if (fixed.common_constant) {
      fill(fixed.constant, fixed.common_constant->colour, tile);
    } else {
      for_each_lane(fixed.constant & inside,
                    [&](int lane) { tile.set(lane, fixed_[pixel_of(column, row, lane)].colour); });
    }
    if (truth != nullptr) {
      for_each_lane(inside, [&](int lane) {
        const std::size_t pixel = pixel_of(column, row, lane);
        const TruthPlan::Fixed& seen = truth_plan_.fixed[pixel];
        if (seen.number < 0) return;
        set_truth(*truth, pixel, seen.number, seen.distance, moment.posed.poses().view.direction(seen.normal));
      });
    }
    if ((fixed.mirror & inside) != 0) reflect(moment, column, row, fixed.mirror & inside, tile, truth);
  }
  if (unknown == 0) return;
  std::array<ImagePoint, kTileRays> points;
  std::array<Colour, kTileRays> seen;
  std::size_t count = 0;
  for_each_lane(unknown,
                [&](int lane) { points[count++] = centre_of(column + lane % kTileSide, row + lane / kTileSide); });
  look(moment, std::span(points).first(count), seen, truth);
  count = 0;
  for_each_lane(unknown, [&](int lane) { tile.set(lane, seen[count++]); });
}

void NativeView::visit_tiles(const Moment& moment, int first_row, int last_row, PixelTruth* truth,
                             const TileVisitor& visit) const {
  thread_local TileVectors tile;
  const int above = (first_row - window_.first_row) % kTileSide;
  for (int row = first_row - above; row <= last_row; row += kTileSide) {
    for (int column = window_.first_column; column <= window_.last_column; column += kTileSide) {
      const int width = std::min(kTileSide, window_.last_column - column + 1);
      std::uint64_t inside = 0;
      for (int y = std::max(row, first_row); y <= std::min(row + kTileSide - 1, last_row); ++y) {
        inside |= ((std::uint64_t{1} << width) - 1) << ((y - row) * kTileSide);
      }
      tile_centres(moment, column, row, inside, tile, truth);
      visit(column, row, inside, tile);
    }
  }
}

std::size_t NativeView::pixel_of(int column, int row, int lane) const {
  return pixel_index(column + lane % kTileSide, row + lane / kTileSide);
}

std::size_t NativeView::lane_of(int x, int y) const {
  const int lane = (y - window_.first_row) % kTileSide * kTileSide + (x - window_.first_column) % kTileSide;
  return std::size_t(lane);
}

std::size_t NativeView::tile_index(int x, int y) const {
  const int tile_columns = (window_.last_column - window_.first_column) / kTileSide + 1;
  const int tile = (y - window_.first_row) / kTileSide * tile_columns + (x - window_.first_column) / kTileSide;
  return std::size_t(tile);
}

void NativeView::reflect(const Moment& moment, int column, int row, std::uint64_t lanes, TileVectors& tile,
                         PixelTruth* truth) const {
  const FixedTile& fixed = fixed_tile_at(column, row);
  thread_local RayBundle bundle;
  thread_local SeenTile seen;
  thread_local Lane weights;
  bundle.used = lanes;
  bundle.t_max.fill(kInfinity);
  transform_rays(moment.posed.poses().view, fixed.origin, fixed.direction, bundle.rays);
  const auto pixel_at = [&](int lane) -> const FixedPixel& { return fixed_[pixel_of(column, row, lane)]; };
  if (fixed.common_mirror) {
    weights.fill(greatest_component(fixed.common_mirror->share));
  } else {
    for_each_lane(lanes, [&](int lane) { weights[std::size_t(lane)] = greatest_component(pixel_at(lane).share); });
  }
  trace_tile(moment.posed, bundle, 2, fixed.surroundings, weights, seen);
  if (fixed.common_mirror) {
    mix(lanes, fixed.common_mirror->colour, fixed.common_mirror->share, seen.colours, tile);
  } else {
    for_each_lane(
        lanes, [&](int lane) { tile.set(lane, pixel_at(lane).colour + pixel_at(lane).share * seen.colours.at(lane)); });
  }
  if (truth == nullptr) return;
  for_each_lane(lanes, [&](int lane) {
    const std::size_t at = pixel_of(column, row, lane);
    if (truth_plan_.fixed[at].number < 0) set_truth(*truth, at, seen, lane, true);
  });
}

void NativeView::look(const Moment& moment, std::span<const ImagePoint> points, std::span<Colour> colours,
                      PixelTruth* truth) const {
  thread_local RayBundle bundle;
  thread_local SeenTile seen;
  thread_local Lane weights;
  const Transform& view = moment.posed.poses().view;
  bundle.t_max.fill(kInfinity);
  weights.fill(1);
  for (std::size_t first = 0; first < points.size(); first += kTileRays) {
    const int count = int(std::min<std::size_t>(kTileRays, points.size() - first));
    bundle.used = ~std::uint64_t{0} >> (kTileRays - count);
    for (int lane = 0; lane < count; ++lane) {
      const ImagePoint& point = points[first + std::size_t(lane)];
      const Ray ray = camera_ray(point);
      bundle.rays.origin.set(lane, view.point(ray.origin));
      bundle.rays.direction.set(lane, normalized(view.direction(ray.direction)));
    }
    fill_unused(bundle);
    trace_tile(moment.posed, bundle, 1, kAllGroups, weights, seen);
    for (int lane = 0; lane < count; ++lane) {
      colours[first + std::size_t(lane)] = seen.colours.at(lane);
      if (truth == nullptr) continue;
      const ImagePoint& point = points[first + std::size_t(lane)];
      set_truth(*truth, pixel_index(int(point.column), int(point.row)), seen, lane, false);
    }
  }
}

void NativeView::store(const TileBytes& bytes, int first_lane, int count, std::size_t pixel, Image& image) {
  std::copy_n(bytes.begin() + std::ptrdiff_t{3} * first_lane, std::ptrdiff_t{3} * count,
              image.bytes.begin() + std::ptrdiff_t{3} * std::ptrdiff_t(pixel));
}

void NativeView::render_plain(const Moment& moment, int band, Image& image, PixelTruth* truth) const {
  const int top = window_.first_row + band * kBlock_px;
  const int bottom = std::min(top + kBlock_px - 1, window_.last_row);
  TileBytes bytes;
  visit_tiles(moment, top, bottom, truth, [&](int column, int row, std::uint64_t inside, const TileVectors& tile) {
    srgb_bytes(tile, bytes);
    for (int y = 0; y < kTileSide; ++y) {
      const int count = std::popcount(inside >> (y * kTileSide) & 0xFF);
      if (count > 0) store(bytes, y * kTileSide, count, pixel_index(column, row + y), image);
    }
  });
}

}  // namespace twocone::sim_povray

// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/native_view.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/sim_povray/render/native/pigment_colour.h"
#include "drivers/sim_povray/render/native/shading.h"
#include "drivers/sim_povray/scene/evaluator.h"

namespace twocone::sim_povray {
namespace {

// POV-Ray smooths an image in squares of this size, from the window's corner, each for itself: measured.
constexpr int kBlock_px = 32;
constexpr int kTileSide = 8;
static_assert(kTileSide * kTileSide == kTileRays && kBlock_px % kTileSide == 0);
// The neighbours' difference from which POV-Ray's +A0.03 takes more samples, and how it weighs light: measured.
constexpr double kSmoothingThreshold = 0.03;
constexpr double kSmoothingGamma = 0.4;

bool is_within(const Vec3& p, const Bounds3& box) {
  return p.x >= box.low.x && p.x <= box.high.x && p.y >= box.low.y && p.y <= box.high.y && p.z >= box.low.z &&
         p.z <= box.high.z;
}

double greatest(const Colour& colour) { return std::max({colour.x, colour.y, colour.z}); }

/// Returns a normal on the side that a ray comes from.
Vec3 against(const Vec3& normal, const Vec3& direction) { return dot(normal, direction) > 0 ? -normal : normal; }

/// Returns a colour as smoothing weighs it.
Colour weighed(const Colour& colour) {
  const auto of = [](double light) { return light > 0 ? std::pow(light, kSmoothingGamma) : 0; };
  return {of(colour.x), of(colour.y), of(colour.z)};
}

bool differ(const Colour& weighed_a, const Colour& weighed_b) {
  const Colour by = weighed_a - weighed_b;
  return std::abs(by.x) + std::abs(by.y) + std::abs(by.z) >= kSmoothingThreshold;
}

}  // namespace

/// The pixels of a block, with one column to its left and one row above it.
struct NativeView::SmoothedBlock {
  struct Pixel {
    Colour colour{};   ///< the centre's, or the mean of the samples
    Colour weighed{};  ///< weighed(colour)
    Colour sampled{};  ///< the mean, if has_samples
    bool has_samples = false;
    bool is_smooth = false;
  };
  Pixel& at(int x, int y) { return pixels[std::size_t(y) + 1][std::size_t(x) + 1]; }
  std::array<std::array<Pixel, kBlock_px + 1>, kBlock_px + 1> pixels{};
};

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
  for (int y = window_.first_row; y <= window_.last_row; y += kTileSide) {
    for (int x = window_.first_column; x <= window_.last_column; x += kTileSide) tiles_.push_back(fixed_tile(x, y));
  }
  if (antialias_ > 1) samples_ = std::vector<LazySamples>(tiles_.size());
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
    pixel = fixed_pixel(camera_ray(x + 0.5, y + 0.5), reflected, meets_own, end);
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
  if (share == Colour{} || description.max_trace_level < 2 || greatest(share) < description.adc_bailout) {
    return pixel;
  }
  pixel.kind = FixedPixel::Kind::kMirror;
  pixel.share = share;
  const Vec3 normal = against(meeting->normal, ray.direction);
  reflected = {meeting->point, ray.direction - normal * (2 * dot(ray.direction, normal))};
  meets_own = nearest(scene_, rest, reflected, RayKind::kReflected, own_).has_value();
  return pixel;
}

NativeView::FixedSamples NativeView::samples_of_tile(int column, int row) const {
  FixedSamples result;
  result.surroundings = ~own_;
  result.samples.resize(std::size_t(kTileRays) * std::size_t(antialias_) * std::size_t(antialias_));
  auto sample = result.samples.begin();
  const auto is_common = [](FixedPixel& common, const FixedPixel& pixel) {
    if (common.kind == FixedPixel::Kind::kAny) common = pixel;
    return common == pixel;
  };
  for (int lane = 0; lane < kTileRays; ++lane) {
    const int x = column + lane % kTileSide;
    const int y = row + lane / kTileSide;
    for (int i = 0; i < antialias_ * antialias_; ++i, ++sample) {
      bool meets_own = false;
      Vec3 end;
      const FixedPixel pixel =
          fixed_pixel(camera_ray(x + (i % antialias_ + 0.5) / antialias_, y + (i / antialias_ + 0.5) / antialias_),
                      sample->reflected, meets_own, end);
      if (pixel.kind == FixedPixel::Kind::kAny || !is_within(end, sight_)) continue;
      if (!is_common(pixel.kind == FixedPixel::Kind::kMirror ? result.mirror : result.constant, pixel)) continue;
      sample->kind = pixel.kind;
      if (meets_own) result.surroundings = kAllGroups;
    }
  }
  return result;
}

const NativeView::FixedSamples& NativeView::fixed_samples(int x, int y) const {
  const std::size_t index = tile_index(x, y);
  LazySamples& lazy = samples_[index];
  std::call_once(lazy.made, [&] {
    lazy.samples = samples_of_tile(x - (x - window_.first_column) % kTileSide, y - (y - window_.first_row) % kTileSide);
  });
  return lazy.samples;
}

NativeView::Moment NativeView::at(Poses poses) const {
  const bool is_planned = is_plan_valid(poses);
  return {PosedScene(scene_, std::move(poses)), is_planned};
}

bool NativeView::is_plan_valid(const Poses& poses) const {
  if (robot_ < 0 || std::size_t(robot_) >= poses.movers.size()) return false;
  if (poses.movers[std::size_t(robot_)] != poses.view) return false;
  const Bounds3 sight = moved(sight_, poses.view);
  const auto& groups = scene_.groups();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (i < kGroupBits && (own_ >> i & 1) != 0) continue;
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
  for_each_lane(unknown, [&](int lane) {
    points[count++] = {column + lane % kTileSide + 0.5, row + lane / kTileSide + 0.5};
  });
  look(moment, std::span(points).first(count), seen, truth);
  count = 0;
  for_each_lane(unknown, [&](int lane) { tile.set(lane, seen[count++]); });
}

template <class Visit>
void NativeView::visit_tiles(const Moment& moment, int first_row, int last_row, PixelTruth* truth, Visit visit) const {
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
  return std::size_t((y - window_.first_row) % kTileSide * kTileSide + (x - window_.first_column) % kTileSide);
}

std::size_t NativeView::tile_index(int x, int y) const {
  const int tile_columns = (window_.last_column - window_.first_column) / kTileSide + 1;
  return std::size_t((y - window_.first_row) / kTileSide * tile_columns + (x - window_.first_column) / kTileSide);
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
    weights.fill(greatest(fixed.common_mirror->share));
  } else {
    for_each_lane(lanes, [&](int lane) { weights[std::size_t(lane)] = greatest(pixel_at(lane).share); });
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
      const Ray ray = camera_ray(point.column, point.row);
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

void NativeView::reflect(const Moment& moment, std::span<const MirrorSample> wanted, std::span<Colour> colours) const {
  thread_local RayBundle bundle;
  thread_local SeenTile seen;
  thread_local Lane weights;
  thread_local TileVectors origin, direction;
  bundle.t_max.fill(kInfinity);
  for (; !wanted.empty(); wanted = wanted.subspan(std::min<std::size_t>(kTileRays, wanted.size()))) {
    const std::size_t count = std::min<std::size_t>(kTileRays, wanted.size());
    GroupSet surroundings = 0;
    for (std::size_t i = 0; i < kTileRays; ++i) {
      const MirrorSample& sample = wanted[std::min(i, count - 1)];
      origin.set(int(i), sample.reflected->origin);
      direction.set(int(i), sample.reflected->direction);
      weights[i] = greatest(sample.tile->mirror.share);
      surroundings |= sample.tile->surroundings;
    }
    bundle.used = ~std::uint64_t{0} >> (kTileRays - count);
    transform_rays(moment.posed.poses().view, origin, direction, bundle.rays);
    trace_tile(moment.posed, bundle, 2, surroundings, weights, seen);
    for (std::size_t i = 0; i < count; ++i) {
      const FixedPixel& mirror = wanted[i].tile->mirror;
      colours[wanted[i].index] = mirror.colour + mirror.share * seen.colours.at(int(i));
    }
  }
}

void NativeView::take_samples(const Moment& moment, int left, int top, std::span<const BlockPlace> places,
                              SmoothedBlock& block) const {
  thread_local std::vector<ImagePoint> points;
  thread_local std::vector<std::size_t> indices;  // of the points' colours
  thread_local std::vector<MirrorSample> reflected;
  thread_local std::vector<Colour> colours, seen;
  const auto samples = std::size_t(antialias_) * std::size_t(antialias_);
  points.clear();
  indices.clear();
  reflected.clear();
  colours.resize(places.size() * samples);
  std::size_t index = 0;
  for (const BlockPlace& place : places) {
    const int x = left + place.x;
    const int y = top + place.y;
    const FixedSamples* const fixed = moment.is_planned ? &fixed_samples(x, y) : nullptr;
    for (std::size_t i = 0; i < samples; ++i, ++index) {
      const FixedSamples::Sample* const sample = fixed ? &fixed->samples[lane_of(x, y) * samples + i] : nullptr;
      if (sample != nullptr && sample->kind == FixedPixel::Kind::kMirror) {
        reflected.push_back({fixed, &sample->reflected, index});
      } else if (sample != nullptr && sample->kind == FixedPixel::Kind::kConstant) {
        colours[index] = fixed->constant.colour;
      } else {
        points.push_back({x + (int(i) % antialias_ + 0.5) / antialias_, y + (int(i) / antialias_ + 0.5) / antialias_});
        indices.push_back(index);
      }
    }
  }
  reflect(moment, reflected, colours);
  seen.resize(points.size());
  look(moment, points, seen);
  for (std::size_t i = 0; i < points.size(); ++i) colours[indices[i]] = seen[i];
  auto colour = colours.begin();
  for (const BlockPlace& place : places) {
    SmoothedBlock::Pixel& pixel = block.at(place.x, place.y);
    pixel.sampled = pixel.colour;
    for (std::size_t i = 0; i < samples; ++i) pixel.sampled += *colour++;
    pixel.sampled = pixel.sampled / double(samples + 1);
    pixel.has_samples = true;
  }
}

void NativeView::smooth(const Moment& moment, int left, int right, int top, int bottom, SmoothedBlock& block) const {
  const int width = right - left + 1;
  const int height = bottom - top + 1;
  // The pixels whose centres differ are nearly all that need samples, and are sampled together.
  thread_local std::vector<BlockPlace> places;
  places.clear();
  const auto add = [&](int x, int y) {
    SmoothedBlock::Pixel& pixel = block.at(x, y);
    if (x < 0 || y < 0 || pixel.has_samples) return;
    pixel.has_samples = true;
    places.push_back({x, y});
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool differs_left = differ(block.at(x, y).weighed, block.at(x - 1, y).weighed);
      const bool differs_above = differ(block.at(x, y).weighed, block.at(x, y - 1).weighed);
      if (differs_left) add(x - 1, y);
      if (differs_above) add(x, y - 1);
      if (differs_left || differs_above) add(x, y);
    }
  }
  take_samples(moment, left, top, places, block);
  const auto replace = [&](int x, int y) {
    SmoothedBlock::Pixel& pixel = block.at(x, y);
    if (x < 0 || y < 0 || pixel.is_smooth) return;
    if (!pixel.has_samples) take_samples(moment, left, top, std::array{BlockPlace{x, y}}, block);
    pixel.colour = pixel.sampled;
    pixel.weighed = weighed(pixel.colour);
    pixel.is_smooth = true;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      // A neighbour counts as it is at this moment, and those of another block are not changed.
      const bool differs_left = differ(block.at(x, y).weighed, block.at(x - 1, y).weighed);
      const bool differs_above = differ(block.at(x, y).weighed, block.at(x, y - 1).weighed);
      if (differs_left) replace(x - 1, y);
      if (differs_above) replace(x, y - 1);
      if (differs_left || differs_above) replace(x, y);
    }
  }
}

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
  if (robot_ < 0) return;
  Poses rest;
  rest.movers.resize(std::size_t(robot_) + 1);
  for (int y = window_.first_row; y <= window_.last_row; ++y) {
    for (int x = window_.first_column; x <= window_.last_column; ++x) {
      const FixedPixel& pixel = fixed_[pixel_index(x, y)];
      if (pixel.kind == FixedPixel::Kind::kAny) continue;
      const Ray ray = camera_ray(x + 0.5, y + 0.5);
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
  return robot_ >= 0 && group.mover == robot_ && greatest(texture.finish.reflection) >= kLeastShare;
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

void NativeView::render_plain(const Moment& moment, int band, Image& image, PixelTruth* truth) const {
  const int top = window_.first_row + band * kBlock_px;
  const int bottom = std::min(top + kBlock_px - 1, window_.last_row);
  std::array<std::uint8_t, 3 * kTileRays> bytes;
  visit_tiles(moment, top, bottom, truth, [&](int column, int row, std::uint64_t inside, const TileVectors& tile) {
    srgb_bytes(tile, bytes);
    for (int y = 0; y < kTileSide; ++y) {
      const int width = std::popcount(inside >> (y * kTileSide) & 0xFF);
      std::copy_n(bytes.data() + 3 * kTileSide * y, 3 * width, image.bytes.data() + 3 * pixel_index(column, row + y));
    }
  });
}

void NativeView::render_smoothed(const Moment& moment, int band, Image& image, PixelTruth* truth) const {
  const int top = window_.first_row + band * kBlock_px;
  const int bottom = std::min(top + kBlock_px - 1, window_.last_row);
  // With one row above and one column to the left.
  const auto columns = std::size_t(window_.last_column - window_.first_column) + 2;
  thread_local std::vector<Colour> colours;
  thread_local std::vector<ImagePoint> outside;
  thread_local std::vector<Colour> seen_outside;
  colours.resize(columns * (kBlock_px + 1));
  const auto at = [&](int x, int y) -> Colour& {
    return colours[std::size_t(y - top + 1) * columns + std::size_t(x - window_.first_column + 1)];
  };
  const auto keep = [&](int column, int row, std::uint64_t inside, const TileVectors& tile) {
    for_each_lane(inside, [&](int lane) { at(column + lane % kTileSide, row + lane / kTileSide) = tile.at(lane); });
  };
  visit_tiles(moment, top, bottom, truth, keep);
  if (band > 0) visit_tiles(moment, top - 1, top - 1, nullptr, keep);
  outside.clear();
  const auto for_each_outside = [&](auto visit) {
    for (int x = window_.first_column; band == 0 && x <= window_.last_column; ++x) visit(x, top - 1);
    for (int y = top - 1; y <= bottom; ++y) visit(window_.first_column - 1, y);
  };
  for_each_outside([&](int x, int y) { outside.push_back({x + 0.5, y + 0.5}); });
  seen_outside.resize(outside.size());
  look(moment, outside, seen_outside);
  std::size_t next = 0;
  for_each_outside([&](int x, int y) { at(x, y) = seen_outside[next++]; });

  thread_local SmoothedBlock block;
  thread_local TileVectors tile;
  std::array<std::uint8_t, 3 * kTileRays> bytes;
  for (int left = window_.first_column; left <= window_.last_column; left += kBlock_px) {
    const int right = std::min(left + kBlock_px - 1, window_.last_column);
    for (int y = top - 1; y <= bottom; ++y) {
      for (int x = left - 1; x <= right; ++x) {
        SmoothedBlock::Pixel& pixel = block.at(x - left, y - top);
        pixel = {.colour = at(x, y)};
        pixel.weighed = weighed(pixel.colour);
      }
    }
    smooth(moment, left, right, top, bottom, block);
    for (int y = top; y <= bottom; ++y) {
      const int width = right - left + 1;
      for (int x = 0; x < width; ++x) tile.set(x, block.at(x, y - top).colour);
      srgb_bytes(tile, bytes);
      std::copy_n(bytes.data(), 3 * width, image.bytes.data() + 3 * pixel_index(left, y));
    }
  }
}

}  // namespace twocone::sim_povray

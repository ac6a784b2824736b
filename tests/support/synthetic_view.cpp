// SPDX-License-Identifier: Apache-2.0
#include "tests/support/synthetic_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include "tests/support/srgb.h"

namespace twocone::testing_support {
namespace {

using PlanRay = SyntheticView::PlanRay;

enum Kind : std::int8_t { kOutside, kInside, kOnRim, kAtTip };

// The cone for rays is a little wider than the mirror, because all corners of pixels on its rim need rays.
constexpr double kWider = 1.05;
// Cells across a pixel that an outline crosses; the greatest number of them, for thin tops; and samples across a pixel
// at the tip and at the rim.
constexpr int kCells = 4;
constexpr int kMostCells = 16;
constexpr int kTipSamples = 32;
constexpr int kRimSamples = 8;
constexpr int kChequerSamples = 4;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

vision::MirrorView widened(const vision::MirrorView& view) {
  vision::MirrorViewSettings s = view.settings();
  const double d = s.cone.lens_to_tip_m;
  s.cone.rim_radius_m *= kWider;
  s.rim_radius_px = view.focal_length_px() / (d / s.cone.rim_radius_m + 1 / std::tan(s.cone.apex_rad / 2));
  return vision::MirrorView(s);
}

/// Returns the tip's position in the camera's image: the middle between two points of the image without distortion.
Eigen::Vector2d tip_of(const vision::MirrorView& view) {
  vision::MirrorViewSettings plain = view.settings();
  if (!plain.distortion) return plain.centre_px;
  plain.distortion.reset();
  const vision::MirrorView undistorted(plain);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const double side_px : {-0.25, 0.25}) {
    const auto ray = undistorted.back_project(plain.centre_px + Eigen::Vector2d(side_px, 0));
    const auto pixel = view.project(ray->origin_m + 3 * ray->direction);
    if (!pixel) throw std::invalid_argument("SyntheticView: the lens does not show the mirror's tip");
    sum += *pixel / 2;
  }
  return sum;
}

/// Returns the share of the square of side 1 about the origin in which f0 + gx x + gy y > 0.
double half_plane_share(double f0, double gx, double gy) {
  gx = std::abs(gx);
  gy = std::abs(gy);
  if (gx < gy) std::swap(gx, gy);
  const double reach = (gx + gy) / 2;  // greatest change of f from the middle of the square
  if (f0 >= reach) return 1;
  if (f0 <= -reach) return 0;
  const bool mostly = f0 > 0;
  const double depth = reach - std::abs(f0);  // distance of the corner beyond the line
  // The smaller part is a triangle while the line cuts off only a corner of the short side, and then a trapezium.
  const double part = depth < gy ? depth * depth / (2 * gx * gy) : (depth - gy / 2) / gx;
  return mostly ? 1 - part : part;
}

/// The values of a function at a cell's corners and middle.
struct Five {
  double c00, c10, c01, c11, middle;
};

/// Returns the share of the cell in which the function is positive. For a straight outline the value at the middle is
/// the corners' mean. A curved outline bulges, and over its path through a cell the mean of the bulge is a third of
/// that at the corners.
double positive_share(const Five& f) {
  const double mean = (f.c00 + f.c10 + f.c01 + f.c11) / 4;
  return half_plane_share((2 * f.middle + mean) / 3, (f.c10 + f.c11 - f.c00 - f.c01) / 2,
                          (f.c01 + f.c11 - f.c00 - f.c10) / 2);
}

/// sRGB codes of light, by linear interpolation between kSteps points; the error is less than 1e-3 of a code.
class SrgbTable {
 public:
  SrgbTable() {
    for (int i = 0; i <= kSteps; ++i) codes_[std::size_t(i)] = static_cast<float>(coded(double(i) / kSteps));
    codes_[kSteps + 1] = codes_[kSteps];
  }
  float operator()(float linear) const {
    const float at = std::clamp(linear, 0.0F, 1.0F) * kSteps;
    const auto i = static_cast<std::size_t>(at);
    return codes_[i] + (at - static_cast<float>(i)) * (codes_[i + 1] - codes_[i]);
  }

 private:
  static constexpr int kSteps = 1 << 15;
  std::array<float, kSteps + 2> codes_;
};

/// Quantiles of the normal distribution at the middles of 65536 equal parts: 16 random bits draw one of them.
class NormalTable {
 public:
  NormalTable() {
    double z = 0;
    for (int i = kSize / 2; i < kSize; ++i) {
      const double above = (kSize - i - 0.5) / kSize;
      for (int step = 0; step < 8; ++step) {  // Newton's method, from the previous quantile
        const double tail = std::erfc(z / std::numbers::sqrt2) / 2;
        z += (tail - above) * std::sqrt(2 * std::numbers::pi) * std::exp(z * z / 2);
      }
      quantiles_[std::size_t(i)] = static_cast<float>(z);
      quantiles_[std::size_t(kSize - 1 - i)] = static_cast<float>(-z);
    }
  }
  float operator[](std::uint64_t bits) const { return quantiles_[bits & (kSize - 1)]; }

 private:
  static constexpr int kSize = 1 << 16;
  std::array<float, kSize> quantiles_;
};

}  // namespace

/// An object that can hide others: a landmark or a strip, with functions of a ray whose signs show whether it is hit.
struct SyntheticView::Surface {
  bool is_strip = false;
  Eigen::Vector2d centre_m;  // for a strip, of its foot
  Eigen::Vector2d outwards;  // a strip's bearing
  double half_m = 0;         // a landmark's radius
  double top_m = std::numeric_limits<double>::infinity();
  double distance_m = 0;
  Eigen::Vector3d colour;
  SyntheticShading shading;

  /// Returns the distance by which the ray passes to the left of the middle, in plan view.
  [[nodiscard]] double left_m(const PlanRay& ray) const {
    if (!is_strip) return cross(centre_m - ray.from_m, ray.along);
    const double ahead = ray.along.dot(outwards);
    if (!(ahead > 0)) return std::numeric_limits<double>::infinity();
    const double way_m = (centre_m - ray.from_m).dot(outwards) / ahead;
    return cross(outwards, ray.from_m + way_m * ray.along - centre_m);
  }
  /// Returns whether the ray is below the top at its point nearest to the axis, and at `beyond_m` to the side of it
  /// where it is higher.
  [[nodiscard]] bool passes_below_top(const PlanRay& ray, double beyond_m = 0) const {
    if (is_strip) return true;
    const double nearest_m = (centre_m - ray.from_m).dot(ray.along);
    return nearest_m > 0 && ray.from_up_m + ray.climb * nearest_m + std::abs(ray.climb) * beyond_m <= top_m;
  }
  /// Returns how far along the ray the height of the top is.
  [[nodiscard]] double way_to_top_m(const PlanRay& ray) const { return (top_m - ray.from_up_m) / ray.climb; }
  /// Returns the radius minus the distance from the axis at which the ray passes while it is below the top: positive
  /// where the ray hits. It is smooth except at the middle line of a strip or landmark.
  [[nodiscard]] double depth_m(const PlanRay& ray) const {
    if (is_strip) return half_m - std::abs(left_m(ray));
    double way_m = std::max(0.0, (centre_m - ray.from_m).dot(ray.along));
    if (ray.climb > 0) way_m = std::min(way_m, way_to_top_m(ray));
    if (ray.climb < 0) way_m = std::max(way_m, way_to_top_m(ray));
    return half_m - (ray.from_m + way_m * ray.along - centre_m).norm();
  }
  [[nodiscard]] Eigen::Vector3d colour_at(const PlanRay& ray) const {
    if (is_strip) return colour;
    const double left = std::clamp(left_m(ray) / half_m, -1.0, 1.0);
    const double towards = std::sqrt(1 - left * left);
    const double entry_m = (centre_m - ray.from_m).dot(ray.along) - towards * half_m;
    if (ray.climb < 0 && way_to_top_m(ray) > entry_m) return colour * shading.top;
    const Eigen::Vector2d normal = -towards * ray.along + left * Eigen::Vector2d(-ray.along.y(), ray.along.x());
    const Eigen::Vector2d light(std::cos(shading.light_bearing_rad), std::sin(shading.light_bearing_rad));
    return colour * (shading.ambient + shading.diffuse * std::max(0.0, normal.dot(light)));
  }
};

std::vector<SyntheticLandmark> seen_from(const std::vector<SyntheticLandmark>& in_world, const Eigen::Vector2d& body_m,
                                         double heading_rad) {
  std::vector<SyntheticLandmark> seen = in_world;
  const double c = std::cos(heading_rad);
  const double s = std::sin(heading_rad);
  for (SyntheticLandmark& landmark : seen) {
    const Eigen::Vector2d p = landmark.centre_m - body_m;
    landmark.centre_m = {c * p.x() + s * p.y(), -s * p.x() + c * p.y()};
  }
  return seen;
}

SyntheticView::SyntheticView(const vision::MirrorView& view, const cv::Size& size,
                             const SyntheticBackground& background)
    : view_(view), wider_(widened(view)), size_(size), background_(background), centre_px_(tip_of(view)) {
  if (size.width <= 0 || size.height <= 0) {
    throw std::invalid_argument(
        fmt::format("SyntheticView: the image is {} x {} px, must be positive", size.width, size.height));
  }
  const PlanRay none{Eigen::Vector2d::Zero(), 0, Eigen::Vector2d::Zero(), 0};
  const auto pixels = std::size_t(size.width) * std::size_t(size.height);
  kind_.assign(pixels, kOutside);
  centres_.assign(pixels, none);
  breadth_rad_.assign(pixels, 0);
  corners_.assign(std::size_t(size.width + 1) * std::size_t(size.height + 1), none);
  std::vector<bool> is_ray(corners_.size());
  std::vector<bool> is_mirror(corners_.size());
  for (int row = 0; row <= size.height; ++row) {
    for (int column = 0; column <= size.width; ++column) {
      const std::size_t i = std::size_t(row) * std::size_t(size.width + 1) + std::size_t(column);
      if (const auto ray = ray_at(column - 0.5, row - 0.5)) {
        corners_[i] = *ray;
        is_ray[i] = true;
        is_mirror[i] = view_.back_project({column - 0.5, row - 0.5}).has_value();
      }
    }
  }
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const std::size_t i = std::size_t(row) * std::size_t(size.width) + std::size_t(column);
      if ((Eigen::Vector2d(column, row) - centre_px_).norm() <= kTipZone_px) {
        kind_[i] = kAtTip;
        for (int k = 0; k < kTipSamples * kTipSamples; ++k) {
          // Exactly at the tip there is no ray; that of its neighbour is used.
          auto ray = ray_at(column - 0.5 + (k % kTipSamples + 0.5) / kTipSamples,
                            row - 0.5 + (k / kTipSamples + 0.5) / kTipSamples);
          if (!ray && tip_rays_.empty()) throw std::invalid_argument("SyntheticView: no ray at the mirror's tip");
          tip_rays_.push_back(ray ? *ray : tip_rays_.back());
        }
        continue;
      }
      const std::size_t corner = i + std::size_t(row);
      const std::array<std::size_t, 4> four = {corner, corner + 1, corner + std::size_t(size.width) + 1,
                                               corner + std::size_t(size.width) + 2};
      const auto in_mirror = std::count_if(four.begin(), four.end(), [&](std::size_t k) { return is_mirror[k]; });
      const bool has_rays = std::all_of(four.begin(), four.end(), [&](std::size_t k) { return is_ray[k]; });
      const auto centre = ray_at(column, row);
      if (in_mirror == 0 || !has_rays || !centre) continue;
      kind_[i] = in_mirror == 4 ? kInside : kOnRim;
      centres_[i] = *centre;
      // A corner's bearing differs from the middle's by at most 0.71 px over h. A lens's distortion and a tilt add less
      // than half of that.
      breadth_rad_[i] = static_cast<float>(1.1 / (Eigen::Vector2d(column, row) - centre_px_).norm());
    }
  }
  fill_background();
}

std::optional<PlanRay> SyntheticView::ray_at(double column, double row) const {
  const auto ray = wider_.back_project({column, row});
  if (!ray) return std::nullopt;
  const Eigen::Vector2d along = ray->direction.head<2>();
  const double length = along.norm();
  return PlanRay{ray->origin_m.head<2>(), ray->origin_m.z(), along / length, ray->direction.z() / length};
}

double SyntheticView::background_at(const PlanRay& ray) const {
  const SyntheticBackground& b = background_;
  const double bearing_rad = std::atan2(ray.along.y(), ray.along.x());
  double grey = b.level * (1 + b.swing * std::cos(bearing_rad - b.swing_bearing_rad)) + b.rise * ray.climb;
  if (b.cells > 0) {
    const double per_cell = b.cells / std::numbers::pi;
    const auto odd = static_cast<long>(std::floor(bearing_rad * per_cell) + std::floor(ray.climb * per_cell)) & 1;
    if (odd != 0) grey *= 1 - b.contrast;
  }
  return grey;
}

void SyntheticView::fill_background() {
  empty_ = cv::Mat::zeros(size_, CV_32FC3);
  for (int row = 0; row < size_.height; ++row) {
    for (int column = 0; column < size_.width; ++column) {
      const std::size_t i = std::size_t(row) * std::size_t(size_.width) + std::size_t(column);
      if (kind_[i] == kOutside) continue;
      if (kind_[i] == kInside && background_.cells == 0) {
        empty_.at<cv::Vec3f>(row, column) = cv::Vec3f::all(static_cast<float>(background_at(centres_[i])));
        continue;
      }
      const int n = kind_[i] == kAtTip ? kTipSamples : kind_[i] == kOnRim ? kRimSamples : kChequerSamples;
      double sum = 0;
      for (int k = 0; k < n * n; ++k) {
        const double x = column - 0.5 + (k % n + 0.5) / n;
        const double y = row - 0.5 + (k / n + 0.5) / n;
        const auto ray = ray_at(x, y);
        if (ray && (kind_[i] == kInside || view_.back_project({x, y}))) sum += background_at(*ray);
      }
      empty_.at<cv::Vec3f>(row, column) = cv::Vec3f::all(static_cast<float>(sum / (n * n)));
    }
  }
}

std::vector<SyntheticView::Surface> SyntheticView::surfaces_of(const SyntheticScene& scene) const {
  const auto& s = view_.settings();
  const double tip_m = s.lens_height_m + s.cone.lens_to_tip_m;
  std::string bad;
  std::vector<Surface> surfaces;
  for (const SyntheticLandmark& landmark : scene.landmarks) {
    Surface& surface = surfaces.emplace_back();
    surface.centre_m = landmark.centre_m;
    surface.half_m = landmark.radius_m;
    surface.top_m = landmark.top_m;
    surface.distance_m = landmark.centre_m.norm();
    surface.colour = landmark.colour;
    surface.shading = scene.shading;
    const double room_m = (landmark.centre_m - s.axis_offset_m).norm() - landmark.radius_m;
    if (!(landmark.radius_m > 0)) bad += fmt::format(" radius_m is {}, must be > 0 m;", landmark.radius_m);
    // The ray at the tip is level for a cone of 90 degrees.
    const double least_m = tip_m + std::max(room_m, 0.0) / std::tan(s.cone.apex_rad);
    if (!(landmark.top_m > least_m)) bad += fmt::format(" top_m is {}, must be > {} m;", landmark.top_m, least_m);
    if (!(room_m > wider_.settings().cone.rim_radius_m)) {
      bad += fmt::format(" a landmark begins {} m from the mirror's axis, must be beyond its rim;", room_m);
    }
  }
  for (const SyntheticStrip& strip : scene.strips) {
    Surface& surface = surfaces.emplace_back();
    surface.is_strip = true;
    surface.outwards = {std::cos(strip.bearing_rad), std::sin(strip.bearing_rad)};
    surface.centre_m = strip.distance_m * surface.outwards;
    surface.half_m = strip.half_width_m;
    surface.distance_m = strip.distance_m;
    surface.colour = strip.colour;
    if (!(strip.half_width_m > 0)) bad += fmt::format(" half_width_m is {}, must be > 0 m;", strip.half_width_m);
    if (!(strip.distance_m > wider_.settings().cone.rim_radius_m)) {
      bad += fmt::format(" a strip is {} m from the body's origin, must be beyond the rim;", strip.distance_m);
    }
  }
  if (!bad.empty()) throw std::invalid_argument("SyntheticView:" + bad);
  std::stable_sort(surfaces.begin(), surfaces.end(),
                   [](const Surface& a, const Surface& b) { return a.distance_m < b.distance_m; });
  return surfaces;
}

void SyntheticView::paint_tip_pixel(const std::vector<Surface>& surfaces, std::size_t tip_pixel,
                                    cv::Vec3f& pixel) const {
  constexpr std::size_t kSamples = std::size_t(kTipSamples) * kTipSamples;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = tip_pixel * kSamples; k < (tip_pixel + 1) * kSamples; ++k) {
    const PlanRay& ray = tip_rays_[k];
    const auto hit =
        std::find_if(surfaces.begin(), surfaces.end(), [&](const Surface& s) { return s.depth_m(ray) > 0; });
    sum += hit != surfaces.end() ? hit->colour_at(ray) : Eigen::Vector3d::Constant(background_at(ray)).eval();
  }
  sum /= double(kSamples);
  pixel = cv::Vec3f(float(sum[0]), float(sum[1]), float(sum[2]));
}

void SyntheticView::paint_pixel(const std::vector<const Surface*>& crossing, int column, int row,
                                cv::Vec3f& pixel) const {
  const std::size_t pixel_index = std::size_t(row) * std::size_t(size_.width) + std::size_t(column);
  const bool is_on_rim = kind_[pixel_index] == kOnRim;
  // A top that is only a few cells wide needs smaller cells. A pixel's width at the landmark is about distance / h.
  const double h_px = (Eigen::Vector2d(column, row) - centre_px_).norm();
  int n = kCells;
  for (const Surface* s : crossing) {
    if (s->is_strip || s->passes_below_top(centres_[pixel_index], s->half_m)) continue;
    const double half_px = s->half_m / s->distance_m * h_px;
    n = std::max(n, static_cast<int>(std::ceil(std::min<double>(kMostCells, kCells / half_px))));
  }
  if (is_on_rim) n = kRimSamples;  // as in the empty image
  std::array<PlanRay, (kMostCells + 1) * (kMostCells + 1)> nodes;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      nodes[std::size_t(j * (n + 1) + i)] = *ray_at(column - 0.5 + double(i) / n, row - 0.5 + double(j) / n);
    }
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d middle_px(column - 0.5 + (i + 0.5) / n, row - 0.5 + (j + 0.5) / n);
      if (is_on_rim && !view_.back_project(middle_px)) continue;
      const std::size_t corner = std::size_t(j * (n + 1) + i);
      const std::array<const PlanRay*, 5> rays = {&nodes[corner], &nodes[corner + 1],
                                                  &nodes[corner + std::size_t(n) + 1],
                                                  &nodes[corner + std::size_t(n) + 2], nullptr};
      const PlanRay middle = *ray_at(middle_px.x(), middle_px.y());
      const auto five = [&](auto&& f) { return Five{f(*rays[0]), f(*rays[1]), f(*rays[2]), f(*rays[3]), f(middle)}; };
      double open = 1;
      for (const Surface* crossed : crossing) {
        const Surface& s = *crossed;
        double share = 0;
        const bool by_sides = s.passes_below_top(middle) && s.passes_below_top(*rays[0]) &&
                              s.passes_below_top(*rays[1]) && s.passes_below_top(*rays[2]) &&
                              s.passes_below_top(*rays[3]);
        if (by_sides) {
          const Five left = five([&](const PlanRay& r) { return s.half_m - s.left_m(r); });
          const Five right = five([&](const PlanRay& r) { return s.half_m + s.left_m(r); });
          share = std::max(0.0, positive_share(left) + positive_share(right) - 1);
        } else {
          share = positive_share(five([&](const PlanRay& r) { return s.depth_m(r); }));
        }
        if (share > 0) sum += open * share * s.colour_at(middle);
        open *= 1 - share;
      }
      if (open > 0) sum += Eigen::Vector3d::Constant(open * background_at(middle));
    }
  }
  sum /= n * n;
  pixel = cv::Vec3f(float(sum[0]), float(sum[1]), float(sum[2]));
}

void SyntheticView::paint(const std::vector<Surface>& surfaces, cv::Mat& light) const {
  std::vector<const Surface*> crossing;
  std::size_t tip_pixel = 0;
  for (int row = 0; row < size_.height; ++row) {
    auto* const pixels = light.ptr<cv::Vec3f>(row);
    for (int column = 0; column < size_.width; ++column) {
      const std::size_t i = std::size_t(row) * std::size_t(size_.width) + std::size_t(column);
      if (kind_[i] == kOutside) continue;
      if (kind_[i] == kAtTip) {
        paint_tip_pixel(surfaces, tip_pixel++, pixels[column]);
        continue;
      }
      const PlanRay& centre = centres_[i];
      const std::array<const PlanRay*, 4> corners = {
          &corners_[i + std::size_t(row)], &corners_[i + std::size_t(row) + 1],
          &corners_[i + std::size_t(row + size_.width) + 1], &corners_[i + std::size_t(row + size_.width) + 2]};
      crossing.clear();
      bool is_cut = kind_[i] == kOnRim;
      bool is_hidden = false;
      for (const Surface& s : surfaces) {
        if (is_hidden) break;
        const Eigen::Vector2d to_centre = s.centre_m - centre.from_m;
        const double ahead = to_centre.dot(centre.along);
        // Skip surfaces that are aside by more than the pixel's own width there.
        const double aside_m = std::abs(cross(to_centre, centre.along));
        if (ahead < -s.half_m || aside_m > s.half_m + (s.half_m + std::abs(ahead)) * double(breadth_rad_[i])) continue;
        const double depth_m = s.depth_m(centre);
        std::array<double, 4> at{};
        std::transform(corners.begin(), corners.end(), at.begin(), [&](const PlanRay* r) { return s.depth_m(*r); });
        const auto [least, most] = std::minmax_element(at.begin(), at.end());
        // The greatest change within the pixel, and half as much again: beyond that, no outline is near.
        const double reach_m = 1.5 * std::max(std::abs(*most - depth_m), std::abs(*least - depth_m));
        if (depth_m < -reach_m && *most < 0) continue;
        crossing.push_back(&s);
        if (depth_m > reach_m && *least > 0) {
          is_hidden = true;
        } else {
          is_cut = true;
        }
      }
      if (crossing.empty()) continue;
      if (is_cut) {
        paint_pixel(crossing, column, row, pixels[column]);
      } else {
        const Eigen::Vector3d colour = crossing.front()->colour_at(centre);
        pixels[column] = cv::Vec3f(float(colour[0]), float(colour[1]), float(colour[2]));
      }
    }
  }
}

cv::Mat SyntheticView::light(const SyntheticScene& scene) const {
  cv::Mat light = empty_.clone();
  paint(surfaces_of(scene), light);
  return light;
}

cv::Mat SyntheticView::coverage(const SyntheticScene& scene, std::size_t k) const {
  // Render an image in which only that landmark shines, in front of a black sky.
  SyntheticScene lit = scene;
  lit.shading = {.ambient = 1, .diffuse = 0, .light_bearing_rad = 0, .top = 1};
  for (SyntheticLandmark& landmark : lit.landmarks) landmark.colour.setZero();
  for (SyntheticStrip& strip : lit.strips) strip.colour.setZero();
  lit.landmarks.at(k).colour.setOnes();
  SyntheticView dark = *this;
  dark.background_ = {.level = 0};
  dark.empty_ = cv::Mat::zeros(size_, CV_32FC3);
  cv::Mat share;
  cv::extractChannel(dark.light(lit), share, 0);
  return share;
}

cv::Mat SyntheticView::image(const SyntheticScene& scene, const SyntheticCamera& camera,
                             std::mt19937_64& random) const {
  static const SrgbTable srgb;
  static const NormalTable normal;
  const cv::Mat light = this->light(scene);
  cv::Mat image(size_, CV_8UC3);
  const auto gain = static_cast<float>(camera.gain);
  const auto noise = static_cast<float>(camera.noise_grey_levels);
  std::uint64_t bits = 0;
  int left = 0;
  for (int row = 0; row < size_.height; ++row) {
    const float* in = light.ptr<float>(row);
    auto* out = image.ptr<std::uint8_t>(row);
    for (int k = 0; k < 3 * size_.width; ++k) {
      float code = srgb(gain * in[k]);
      if (noise > 0) {
        if (left == 0) {
          bits = random();
          left = 4;
        }
        code += noise * normal[bits];
        bits >>= 16;
        --left;
      }
      out[k] = static_cast<std::uint8_t>(std::clamp(std::lround(code), 0L, 255L));
    }
  }
  return image;
}

}  // namespace twocone::testing_support

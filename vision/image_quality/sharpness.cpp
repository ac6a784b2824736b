// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <opencv2/imgproc.hpp>

#include "base/quantile.h"
#include "vision/image_quality.h"
#include "vision/image_quality/shared.h"
#include "vision/srgb.h"

namespace twocone::vision {
namespace {

constexpr double kNarrow_px2 = 0.81;           // variance of the first smoothing
constexpr double kWide_px2 = 2.56;             // variance of both smoothings together
constexpr double kMeanDifferences_px2 = 0.25;  // mean over all directions of the part that spread_px2() subtracts
constexpr double kMostDefocus_px = 10;
constexpr double kPixel_px2 = 1. / 12;
constexpr double kLeastStep = 0.3;  // share of the region's mean light: noise of 4 levels changes its steepness by 2 %
constexpr double kPlateau_px = 4;   // distance of plateaus from the edge: 2.5 sigma of the wide smoothing
constexpr double kLevel = 0.3;      // greatest steepness of a plateau, as a share of the edge's
constexpr int kClippedCode = 253;
constexpr int kMargin_px = 6;
constexpr std::size_t kLeastEdges = 30;

/// Computes the gradient by differences over two pixels, in light per px.
Eigen::Vector2f gradient(const cv::Mat_<float>& light, int row, int column) {
  return {(light(row, column + 1) - light(row, column - 1)) / 2, (light(row + 1, column) - light(row - 1, column)) / 2};
}

/// Returns the greatest steepness on the line from one neighbour to the opposite one. Steepness is Gaussian along any
/// line across an edge, so its logarithm is a parabola. Returns nothing where the maximum is not between the two.
std::optional<double> peak(const cv::Mat_<float>& light, int row, int column, int down, int right) {
  std::array<double, 3> logs{};
  for (int i = 0; i < 3; ++i) {
    const int step = i - 1;
    logs[std::size_t(i)] = std::log(std::max(1e-9F, gradient(light, row + step * down, column + step * right).norm()));
  }
  const double bend = logs[0] - 2 * logs[1] + logs[2];
  const double slope = (logs[2] - logs[0]) / 2;
  if (!(bend < 0) || std::abs(slope) > -bend) return std::nullopt;
  return std::exp(logs[1] - slope * slope / 2 / bend);
}

/// Returns v as a function of R^2 (image_quality.h).
double spread_of(double ratio2) { return (kWide_px2 - ratio2 * kNarrow_px2) / (ratio2 - 1); }

/// Returns the edge's variance in px^2 if a strong single edge is at that pixel.
std::optional<double> spread_px2(const cv::Mat& rgb, const cv::Mat_<float>& narrow, const cv::Mat_<float>& wide,
                                 int row, int column) {
  const Eigen::Vector2f steep = gradient(wide, row, column);
  const float size = steep.norm();
  const Eigen::Vector2f across = steep / size;
  const int right = int(std::lround(across.x() * std::numbers::sqrt2));  // -1, 0 or 1: the nearest of 8 directions
  const int down = int(std::lround(across.y() * std::numbers::sqrt2));
  if (gradient(wide, row + down, column + right).norm() > size) return std::nullopt;
  if (gradient(wide, row - down, column - right).norm() >= size) return std::nullopt;
  for (const float side : {-1.F, 1.F}) {
    const int x = column + int(std::lround(side * across.x() * float(kPlateau_px)));
    const int y = row + int(std::lround(side * across.y() * float(kPlateau_px)));
    if (gradient(narrow, y, x).norm() > float(kLevel) * size) return std::nullopt;
    const cv::Vec3b& code = rgb.at<cv::Vec3b>(y, x);
    if (code[0] >= kClippedCode || code[1] >= kClippedCode || code[2] >= kClippedCode) return std::nullopt;
  }
  const auto first = peak(narrow, row, column, down, right);
  const auto second = peak(wide, row, column, down, right);
  if (!first || !second || *first <= *second) return std::nullopt;
  // Differences over two pixels approximate f' + f''' / 6 along each axis, which adds a spread of its own.
  const double differences = (std::pow(across.x(), 4) + std::pow(across.y(), 4)) / 3;
  return spread_of(std::pow(*first / *second, 2)) - differences;
}

/// Returns the spread that blur_px() measures for edges of variance `before_px2` after each point is spread over a
/// disc, as the simulator's camera does it: by the disc's share in each pixel.
double spread_with_disc_px2(double before_px2, double radius_px) {
  const auto below = [radius_px](double x) {  // share of the disc below the line at x
    const double t = radius_px > 0 ? std::clamp(x / radius_px, -1., 1.) : std::copysign(1., x);
    return 0.5 + (t * std::sqrt(1 - t * t) + std::asin(t)) / std::numbers::pi;
  };
  const auto steepness = [&](double variance_px2) {
    double sum = 0;
    const int reach = int(std::ceil(radius_px));
    for (int k = -reach; k <= reach; ++k) {
      sum += (below(k + 0.5) - below(k - 0.5)) * std::exp(-k * k / (2 * variance_px2));
    }
    return sum / std::sqrt(variance_px2);
  };
  const double narrow = kNarrow_px2 + kMeanDifferences_px2 + before_px2;
  const double wide = kWide_px2 + kMeanDifferences_px2 + before_px2;
  return spread_of(std::pow(steepness(narrow) / steepness(wide), 2)) - kMeanDifferences_px2;
}

}  // namespace

std::optional<double> blur_px(const cv::Mat& rgb, const ImageRegion& region) {
  image_quality::check("blur_px", rgb, region);
  const double reach = region.outer * region.radius_px;
  const auto first = [](double from) { return int(std::ceil(std::max(double(kMargin_px), from))); };
  const auto last = [](double to, int size) { return int(std::floor(std::min(to, double(size - 1 - kMargin_px)))); };
  const int top = first(region.centre_px.y() - reach);
  const int bottom = last(region.centre_px.y() + reach, rgb.rows);
  if (top > bottom) return std::nullopt;

  cv::Mat_<float> narrow, wide;
  cv::GaussianBlur(linear_grey(rgb), narrow, {9, 9}, std::sqrt(kNarrow_px2));
  cv::GaussianBlur(narrow, wide, {11, 11}, std::sqrt(kWide_px2 - kNarrow_px2));

  struct Span {
    int row, from, to;
  };
  std::vector<Span> spans;
  double light = 0;
  double pixels = 0;
  for (int row = top; row <= bottom; ++row) {
    const double dy = row - region.centre_px.y();
    const double half = std::sqrt(std::max(0., reach * reach - dy * dy));
    const Span span{row, first(region.centre_px.x() - half), last(region.centre_px.x() + half, rgb.cols)};
    for (int column = span.from; column <= span.to; ++column) light += double(wide(row, column));
    pixels += std::max(0, span.to - span.from + 1);
    spans.push_back(span);
  }
  if (pixels == 0) return std::nullopt;
  // Steepness of the smallest step after smoothing.
  const auto least = float(kLeastStep * light / pixels / std::sqrt(2 * std::numbers::pi * (kWide_px2 + 0.4)));
  const float least2 = 4 * least * least;
  std::vector<double> spreads;
  for (const Span& span : spans) {
    const float* const above = wide.ptr<float>(span.row - 1);
    const float* const here = wide.ptr<float>(span.row);
    const float* const below = wide.ptr<float>(span.row + 1);
    for (int column = span.from; column <= span.to; ++column) {
      const float x = here[column + 1] - here[column - 1];
      const float y = below[column] - above[column];
      if (x * x + y * y < least2 || !image_quality::is_within(region, column, span.row, kMargin_px)) continue;
      if (const auto spread = spread_px2(rgb, narrow, wide, span.row, column)) spreads.push_back(*spread);
    }
  }
  if (spreads.size() < kLeastEdges) return std::nullopt;
  return std::sqrt(std::max(0., base::median(std::move(spreads)) + kPixel_px2));
}

double defocus_radius_px(double simulated_blur_px, double real_blur_px) {
  const double before = std::max(0., simulated_blur_px * simulated_blur_px - kPixel_px2);
  const double after = real_blur_px * real_blur_px - kPixel_px2;
  double least = 0;
  double most = kMostDefocus_px;
  constexpr double kRounding_px2 = 1e-9;
  if (!(after > before + kRounding_px2)) return 0;
  for (int i = 0; i < 40; ++i) {
    const double middle = (least + most) / 2;
    (spread_with_disc_px2(before, middle) < after ? least : most) = middle;
  }
  return (least + most) / 2;
}

}  // namespace twocone::vision

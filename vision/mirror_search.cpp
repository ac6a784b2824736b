// SPDX-License-Identifier: Apache-2.0
#include "vision/mirror_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

namespace twocone::vision {
namespace {

constexpr int kReducedSide_px = 160;
constexpr int kFineSide_px = 320;  // it separates the edges of a ring that is a fiftieth of the image wide
// Images of a drive beyond this number add work and no information about what stays in place.
constexpr std::size_t kMostImages = 12;
// Code of the light below which HueLabels finds no hue (kMinBrightness), and the share of pixels that may be brighter:
// hot pixels, and a leak of light.
constexpr double kDarkGrey = 25;
constexpr double kBrightShare = 0.01;
// Slopes in grey levels per reduced pixel. Noise of 4 levels is below 1 after averaging 16 pixels, and the slope's
// kernel averages it again; three times that is no noise.
constexpr double kLeastSlope = 3;
constexpr double kFullSlope = 12;
constexpr double kLeastStrength = 0.25;
// An even image has no edges but those of noise; the smallest rim that is searched has 2 pi 16 edge pixels.
constexpr std::size_t kLeastEdges = 60;

constexpr int kDirections = 64;
constexpr double kLeastRadiusShare = 0.1;  // of the longer side
constexpr double kMostRadiusShare = 0.7;
constexpr int kCoarseStep_px = 2;
// Cosine of the angle between an edge's normal and the direction from the centre: 13 degrees. The slopes of a reduced
// edge are accurate to some 5 degrees, and half a coarse step is 5 degrees of the smallest circle.
constexpr double kAligned = 0.974;
// Less of a circle inside the image does not determine it.
constexpr double kLeastVisible = 0.4;
constexpr double kLeastCoarseSupport = 0.25;
constexpr std::size_t kMostCandidates = 8;
// The search at full size extends over this much, to either side of a fine circle.
constexpr double kLeastSearch_px = 4;
constexpr double kSearchFine_px = 2.5;
// Circles are concentric within this share of the radius, and a ring is not wider than kRingShare of it.
constexpr double kConcentric = 0.06;
constexpr double kRingShare = 0.35;
constexpr double kAsGood = 0.75;
// Share of upright edges. kUprightByChance is 0.16; tests/vision/mirror_search_test.cpp has rooms and other images.
constexpr double kLeastUpright = 0.3;

/// An edge of the reduced images, averaged over them.
struct ReducedEdge {
  float x, y;
  float normal_x, normal_y;  ///< unit length; its sign has no meaning
  float strength;            ///< 0 to 1
};

struct Slopes {
  cv::Mat dx, dy;  ///< CV_32F, of the channel with the steepest slope
};

Slopes slopes_of(const cv::Mat& reduced) {
  std::array<cv::Mat, 3> channels;
  cv::split(reduced, channels.data());
  Slopes slopes{cv::Mat::zeros(reduced.size(), CV_32F), cv::Mat::zeros(reduced.size(), CV_32F)};
  for (const cv::Mat& channel : channels) {
    cv::Mat dx;
    cv::Mat dy;
    cv::Scharr(channel, dx, CV_32F, 1, 0, 1.0 / 32);
    cv::Scharr(channel, dy, CV_32F, 0, 1, 1.0 / 32);
    for (int row = 0; row < reduced.rows; ++row) {
      for (int column = 0; column < reduced.cols; ++column) {
        float& best_x = slopes.dx.at<float>(row, column);
        float& best_y = slopes.dy.at<float>(row, column);
        const float x = dx.at<float>(row, column);
        const float y = dy.at<float>(row, column);
        if (x * x + y * y <= best_x * best_x + best_y * best_y) continue;
        best_x = x;
        best_y = y;
      }
    }
  }
  return slopes;
}

/// Returns the edges that stay in place, thinned across their direction.
std::vector<ReducedEdge> lasting_edges(const std::vector<cv::Mat>& reduced) {
  const cv::Size size = reduced.front().size();
  cv::Mat cosines = cv::Mat::zeros(size, CV_32F);  // of the doubled angle, weighted
  cv::Mat sines = cv::Mat::zeros(size, CV_32F);
  for (const cv::Mat& image : reduced) {
    const Slopes slopes = slopes_of(image);
    for (int row = 0; row < size.height; ++row) {
      for (int column = 0; column < size.width; ++column) {
        const double x = slopes.dx.at<float>(row, column);
        const double y = slopes.dy.at<float>(row, column);
        const double slope = std::hypot(x, y);
        if (slope < kLeastSlope) continue;
        const double weight = std::min(1.0, slope / kFullSlope) / (slope * slope) / double(reduced.size());
        cosines.at<float>(row, column) += static_cast<float>(weight * (x * x - y * y));
        sines.at<float>(row, column) += static_cast<float>(weight * 2 * x * y);
      }
    }
  }
  cv::Mat strength;
  cv::magnitude(cosines, sines, strength);
  std::vector<ReducedEdge> edges;
  for (int row = 1; row < size.height - 1; ++row) {
    for (int column = 1; column < size.width - 1; ++column) {
      const float here = strength.at<float>(row, column);
      if (here < kLeastStrength) continue;
      const double angle = std::atan2(sines.at<float>(row, column), cosines.at<float>(row, column)) / 2;
      const auto x = static_cast<float>(std::cos(angle));
      const auto y = static_cast<float>(std::sin(angle));
      // The neighbour across the edge, to either side. On a plateau one side may be equal.
      const int to_x = static_cast<int>(std::lround(x));
      const int to_y = static_cast<int>(std::lround(y));
      if (strength.at<float>(row + to_y, column + to_x) > here ||
          strength.at<float>(row - to_y, column - to_x) > here) {
        continue;
      }
      edges.push_back({static_cast<float>(column), static_cast<float>(row), x, y, std::min(1.0F, here)});
    }
  }
  return edges;
}

/// A circle of the reduced image.
struct ReducedCircle {
  double x = 0, y = 0, radius = 0;
  double support = 0;
};

/// Counts, for one centre, the edges by radius and direction.
class Polar {
 public:
  explicit Polar(const cv::Size& size)
      : size_(size),
        least_(std::max(6.0, kLeastRadiusShare * std::max(size.width, size.height))),
        most_(kMostRadiusShare * std::max(size.width, size.height)) {
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2 * std::numbers::pi * (i + 0.5) / kDirections - std::numbers::pi;
      out_[std::size_t(i)] = {std::cos(angle), std::sin(angle)};
    }
  }

  /// Returns the support of each radius, from least_ on in steps of `step_px`.
  const std::vector<ReducedCircle>& at(const std::vector<ReducedEdge>& edges, double x, double y, double step_px) {
    const auto rings = static_cast<std::size_t>((most_ - least_) / step_px) + 1;
    cells_.assign(rings * kDirections, 0);
    for (const ReducedEdge& edge : edges) {
      const double dx = edge.x - x;
      const double dy = edge.y - y;
      const double along = dx * edge.normal_x + dy * edge.normal_y;
      const double square = dx * dx + dy * dy;
      if (along * along < kAligned * kAligned * square) continue;
      const double radius = std::sqrt(square);
      if (radius < least_ - step_px || radius > most_ + step_px) continue;
      const double turn = (cv::fastAtan2(static_cast<float>(dy), static_cast<float>(dx)) + 180) / 360;
      const std::size_t direction = std::size_t(turn * kDirections) % kDirections;
      // A ring takes the edges within one step of it.
      const double ring = (radius - least_) / step_px;
      for (int r = std::max(0, static_cast<int>(std::ceil(ring - 1)));
           r <= std::min(static_cast<int>(rings) - 1, static_cast<int>(std::floor(ring + 1))); ++r) {
        float& cell = cells_[std::size_t(r) * kDirections + direction];
        cell = std::max(cell, edge.strength);
      }
    }
    circles_.clear();
    for (std::size_t r = 0; r < rings; ++r) {
      double sum = 0;
      for (std::size_t i = 0; i < kDirections; ++i) sum += double(cells_[r * kDirections + i]);
      const double radius = least_ + step_px * double(r);
      const double visible = sum > kLeastCoarseSupport * kLeastVisible * kDirections ? visible_share(x, y, radius) : 0;
      circles_.push_back({x, y, radius, visible < kLeastVisible ? 0 : sum / (visible * kDirections)});
    }
    return circles_;
  }

 private:
  /// Returns the share of the circle that lies in the image.
  [[nodiscard]] double visible_share(double x, double y, double radius) const {
    const auto is_visible = [&](const std::array<double, 2>& out) {
      const double column = x + radius * out[0];
      const double row = y + radius * out[1];
      return column >= 1 && row >= 1 && column < size_.width - 1 && row < size_.height - 1;
    };
    return double(std::ranges::count_if(out_, is_visible)) / kDirections;
  }

  cv::Size size_;
  double least_, most_;
  std::array<std::array<double, 2>, kDirections> out_{};
  std::vector<float> cells_;  ///< ring by ring
  std::vector<ReducedCircle> circles_;
};

bool are_close(const ReducedCircle& a, const ReducedCircle& b, double reach) {
  return std::hypot(a.x - b.x, a.y - b.y) <= reach && std::abs(a.radius - b.radius) <= reach;
}

/// Returns the circles with most support, each better than all near it.
std::vector<ReducedCircle> best_circles(const std::vector<ReducedEdge>& edges, const cv::Size& size) {
  Polar polar(size);
  std::vector<ReducedCircle> all;
  for (int y = 0; y < size.height; y += kCoarseStep_px) {
    for (int x = 0; x < size.width; x += kCoarseStep_px) {
      for (const ReducedCircle& circle : polar.at(edges, x, y, kCoarseStep_px)) {
        if (circle.support >= kLeastCoarseSupport) all.push_back(circle);
      }
    }
  }
  std::ranges::sort(all, std::greater{}, &ReducedCircle::support);
  std::vector<ReducedCircle> best;
  for (const ReducedCircle& circle : all) {
    constexpr double kReach_px = 2 * kCoarseStep_px;
    const auto is_near = [&](const ReducedCircle& other) { return are_close(circle, other, kReach_px); };
    if (std::ranges::any_of(best, is_near)) continue;
    best.push_back(circle);
    if (best.size() == kMostCandidates) break;
  }
  return best;
}

/// Returns the circles near a coarse one, in an image that is reduced less, by `factor`: the edges of a ring are two.
std::vector<ReducedCircle> fine_circles(const std::vector<ReducedEdge>& edges, const cv::Size& size,
                                        const ReducedCircle& coarse, double factor) {
  Polar polar(size);
  std::vector<ReducedCircle> by_radius;
  const double x = (coarse.x + 0.5) * factor - 0.5;
  const double y = (coarse.y + 0.5) * factor - 0.5;
  const int reach = static_cast<int>(std::ceil(kCoarseStep_px * factor));
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const auto& here = polar.at(edges, x + dx, y + dy, 1);
      by_radius.resize(here.size());
      for (std::size_t r = 0; r < here.size(); ++r) {
        if (std::abs(here[r].radius / factor - coarse.radius) > kRingShare * coarse.radius) continue;
        if (here[r].support > by_radius[r].support) by_radius[r] = here[r];
      }
    }
  }
  const double best = std::ranges::max_element(by_radius, {}, &ReducedCircle::support)->support;
  std::vector<ReducedCircle> circles;
  for (std::size_t r = 1; r + 1 < by_radius.size(); ++r) {
    const double support = by_radius[r].support;
    // A ring takes the edges within a step, so that neighbours may be equal.
    if (support < kAsGood * best || support < by_radius[r - 1].support || support <= by_radius[r + 1].support) continue;
    circles.push_back(by_radius[r]);
  }
  return circles;
}

/// Returns the share of the single images' edges inside the circle that point at its middle.
double upright_share_of(const std::vector<cv::Mat>& reduced, const ReducedCircle& circle) {
  double upright = 0;
  double all = 0;
  const double sine = std::sin(kUpright_rad);
  for (const cv::Mat& image : reduced) {
    for (const ReducedEdge& edge : lasting_edges({image})) {
      const double dx = edge.x - circle.x;
      const double dy = edge.y - circle.y;
      const double radius = std::hypot(dx, dy);
      // Near the tip a pixel of the centre's error turns the direction too far, and the rim itself is no evidence.
      if (radius < 0.15 * circle.radius || radius > 0.93 * circle.radius) continue;
      all += edge.strength;
      if (std::abs(edge.normal_x * dx + edge.normal_y * dy) < sine * radius) upright += edge.strength;
    }
  }
  return all > 0 ? upright / all : 0;
}

/// Locates the circle in an image of full size.
std::optional<RimMeasurement> located(const cv::Mat& image, const RimCircle& expected, double search_px) {
  const double share = std::min(kRimSearch, std::max(kLeastSearch_px, search_px) / expected.radius_px);
  if (auto rim = measure_rim(image, expected, share)) return rim;
  const auto rough = find_rim(image, expected, share);
  if (!rough) return std::nullopt;
  return RimMeasurement{rough->centre_px,  rough->radius_px,  kRoughRimSigma_px,
                        kRoughRimSigma_px, kRoughRimSigma_px, rough->support};
}

}  // namespace

std::string_view to_string(MirrorVerdict verdict) {
  constexpr std::array<std::string_view, 5> kNames{"found", "dark", "even", "no_circle", "no_mirror"};
  return kNames.at(std::size_t(verdict));
}

MirrorSearch find_mirror(std::span<const cv::Mat> images) {
  if (images.empty()) throw std::invalid_argument("find_mirror: there is no image, must be at least one");
  std::vector<cv::Mat> chosen;
  const std::size_t count = std::min(kMostImages, images.size());
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(images[i * images.size() / count]);
  const cv::Mat median = median_image(chosen);  // throws for a wrong type and for sizes that differ
  const cv::Size full = median.size();
  const auto reduced_to = [&](int side_px) {
    const double factor = std::max(1.0, double(std::max(full.width, full.height)) / side_px);
    const cv::Size size(std::max(3, static_cast<int>(full.width / factor)),
                        std::max(3, static_cast<int>(full.height / factor)));
    std::vector<cv::Mat> images_there;
    for (const cv::Mat& image : chosen) cv::resize(image, images_there.emplace_back(), size, 0, 0, cv::INTER_AREA);
    return images_there;
  };
  const std::vector<cv::Mat> reduced = reduced_to(kReducedSide_px);
  const cv::Size size = reduced.front().size();

  MirrorSearch found;
  const auto is_dark = [](const cv::Mat& image) {
    const cv::Mat codes = image.reshape(1);
    return cv::countNonZero(codes >= kDarkGrey) <= kBrightShare * double(codes.total());
  };
  if (std::ranges::all_of(reduced, is_dark)) {
    found.verdict = MirrorVerdict::kDark;
    return found;
  }
  const std::vector<ReducedEdge> edges = lasting_edges(reduced);
  if (edges.size() < kLeastEdges) {
    found.verdict = MirrorVerdict::kEven;
    return found;
  }
  struct Located {
    RimMeasurement rim;
    double upright_share;
  };
  std::vector<Located> circles;
  const std::vector<cv::Mat> less_reduced = reduced_to(kFineSide_px);
  const std::vector<ReducedEdge> fine_edges = lasting_edges(less_reduced);
  const cv::Size fine_size = less_reduced.front().size();
  const double scale = double(full.width) / fine_size.width;
  const auto add = [&](const ReducedCircle& fine, double upright_share) {
    const RimCircle expected{
        {(fine.x + 0.5) * scale - 0.5, (fine.y + 0.5) * scale - 0.5}, fine.radius * scale, fine.support};
    auto rim = located(median, expected, kSearchFine_px * scale);
    if (!rim) rim = located(chosen.front(), expected, kSearchFine_px * scale);
    if (!rim) return;
    const auto is_same = [&](const Located& other) {
      return (other.rim.centre_px - rim->centre_px).norm() < kLeastSearch_px / 2 &&
             std::abs(other.rim.radius_px - rim->radius_px) < kLeastSearch_px / 2;
    };
    if (std::ranges::none_of(circles, is_same)) circles.push_back({*rim, upright_share});
  };
  for (const ReducedCircle& circle : best_circles(edges, size)) {
    const double upright_share = upright_share_of(reduced, circle);
    for (const ReducedCircle& fine :
         fine_circles(fine_edges, fine_size, circle, double(fine_size.width) / size.width)) {
      add(fine, upright_share);
    }
  }
  if (circles.empty()) return found;
  found.verdict = MirrorVerdict::kNoMirror;
  const auto is_cone = [](const Located& circle) { return circle.upright_share >= kLeastUpright; };
  if (std::ranges::none_of(circles, is_cone)) {
    found.upright_share = std::ranges::max_element(circles, {}, &Located::upright_share)->upright_share;
    return found;
  }
  std::erase_if(circles, [&](const Located& circle) { return !is_cone(circle); });
  // The best is the circle with most support; rings about it follow, from the inside.
  const Located best = *std::ranges::max_element(circles, {}, [](const Located& c) { return c.rim.support; });
  std::erase_if(circles, [&](const Located& circle) {
    return (circle.rim.centre_px - best.rim.centre_px).norm() > kConcentric * best.rim.radius_px ||
           std::abs(circle.rim.radius_px / best.rim.radius_px - 1) > kRingShare ||
           circle.rim.support < kAsGood * best.rim.support;
  });
  std::ranges::sort(circles, {}, [](const Located& c) { return c.rim.radius_px; });
  found.verdict = MirrorVerdict::kFound;
  found.rim = circles.front().rim;
  found.upright_share = circles.front().upright_share;
  for (std::size_t i = 1; i < circles.size(); ++i) found.others.push_back(circles[i].rim);
  found.tip = measure_tip(chosen, found.rim->centre_px, tip_reach_px(found.rim->radius_px));
  return found;
}

}  // namespace twocone::vision

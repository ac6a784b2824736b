// SPDX-License-Identifier: Apache-2.0
#include "localisation/paper_trilateration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace twocone::localisation {
namespace {

// Beyond this, differences of coordinates overflow; no world is that large.
constexpr double kFarthest_m = 1e300;

struct CircleOfRange {
  Eigen::Vector2d centre_m;  // relative to the first landmark
  double radius_m;
};

/// The intersections of two circles: a point and its mirror image in the line of centres; equal where they touch or
/// miss.
struct Meeting {
  Eigen::Vector2d left_m;
  Eigen::Vector2d right_m;
  bool gap;
};

/// Computes the area of a triangle from its sides, by Kahan's form of Heron's formula. Every bracket is a difference of
/// given numbers or a sum of positive ones, so near-degenerate triangles keep the digits of their sides. Returns
/// nothing where the sides close no triangle.
std::optional<double> area_of(double a, double b, double c) {
  std::array<double, 3> s{a, b, c};
  std::sort(s.begin(), s.end(), std::greater<>());
  const double closing = s[2] - (s[0] - s[1]);  // < 0: they close none
  // Each side was rounded once, and so was the inner difference: below this, "touch" and "just not" are the same.
  const double rounding = 4 * std::numeric_limits<double>::epsilon() * s[0];
  if (std::abs(closing) <= rounding) return 0;
  if (closing < 0) return std::nullopt;
  return std::sqrt((s[0] + (s[1] + s[2])) * closing * (s[2] + (s[0] - s[1])) * (s[0] + (s[1] - s[2]))) / 4;
}

/// Intersects two circles. Returns nothing for circles with one centre.
std::optional<Meeting> meet(const CircleOfRange& a, const CircleOfRange& b) {
  const Eigen::Vector2d between = b.centre_m - a.centre_m;
  const double distance = std::hypot(between.x(), between.y());
  if (distance == 0) return std::nullopt;
  const Eigen::Vector2d along = between / distance;

  const auto area_m2 = area_of(distance, a.radius_m, b.radius_m);
  if (!area_m2) {
    // The circles are side by side, or one is inside the other: take the two points on the line of centres where they
    // are nearest to each other.
    const bool outside = a.radius_m + b.radius_m < distance;
    const double from_a = outside || a.radius_m > b.radius_m ? a.radius_m : -a.radius_m;
    const double from_b = outside || b.radius_m > a.radius_m ? distance - b.radius_m : distance + b.radius_m;
    const Eigen::Vector2d middle = a.centre_m + along * ((from_a + from_b) / 2);
    return Meeting{middle, middle, true};
  }
  const double reach = (distance + (a.radius_m - b.radius_m) * ((a.radius_m + b.radius_m) / distance)) / 2;
  const double height = 2 * *area_m2 / distance;
  const Eigen::Vector2d foot = a.centre_m + along * reach;
  const Eigen::Vector2d across(-along.y() * height, along.x() * height);
  return Meeting{foot + across, foot - across, false};
}

/// Returns the distance of `p_m` from the circle.
double miss(const Eigen::Vector2d& p_m, const CircleOfRange& circle) {
  return std::abs(std::hypot(p_m.x() - circle.centre_m.x(), p_m.y() - circle.centre_m.y()) - circle.radius_m);
}

struct Corner {
  Eigen::Vector2d chosen_m;
  Eigen::Vector2d other_m;  // equals chosen_m unless the two are tied
  bool gap = false;
  bool tied = false;
};

Corner choose(const Meeting& m, const CircleOfRange& third) {
  const double left = miss(m.left_m, third);
  const double right = miss(m.right_m, third);
  // An intersection has the rounding of its foot and height: a few units in the last place of the lengths from which it
  // is computed. A difference of two distances has this rounding twice.
  const double rounding = 16 * std::numeric_limits<double>::epsilon() *
                          (m.left_m.norm() + m.right_m.norm() + third.centre_m.norm() + third.radius_m);
  const bool tied = std::abs(left - right) <= rounding && (m.left_m - m.right_m).norm() > rounding;
  Corner corner{left <= right ? m.left_m : m.right_m, left <= right ? m.right_m : m.left_m, m.gap, tied};
  if (!tied) corner.other_m = corner.chosen_m;
  return corner;
}

Eigen::Vector2d mean(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const auto& p : points) sum += p;
  return sum / double(points.size());
}

}  // namespace

Fix fix_by_triangle(std::span<const LandmarkRange> ranges) {
  Fix fix;
  std::vector<LandmarkRange> usable;
  for (const LandmarkRange& r : ranges) {
    if (r.range_m >= 0 && r.range_m <= kFarthest_m && (r.landmark_m.array().abs() <= kFarthest_m).all()) {
      usable.push_back(r);
    } else {
      ++fix.unusable;
    }
  }
  if (usable.size() < 3) return fix;  // kTooFew
  std::ranges::stable_sort(usable, {}, &LandmarkRange::range_m);
  const Eigen::Vector2d origin = usable.front().landmark_m;
  std::array<CircleOfRange, 3> circles;
  double largest_m = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    circles[i] = {usable[i].landmark_m - origin, usable[i].range_m};
    largest_m = std::max({largest_m, circles[i].radius_m, circles[i].centre_m.cwiseAbs().maxCoeff()});
  }
  // In units of the largest length, Heron's product of four neither overflows nor underflows. The unit is a power of
  // two, so no digit changes.
  int exponent = 0;
  std::frexp(largest_m, &exponent);
  const double unit_m = std::ldexp(1.0, exponent - 1);
  for (CircleOfRange& circle : circles) circle = {circle.centre_m / unit_m, circle.radius_m / unit_m};

  std::vector<Corner> corners;
  for (const auto& [a, b, third] : {std::array{0, 1, 2}, std::array{0, 2, 1}, std::array{1, 2, 0}}) {
    if (const auto meeting = meet(circles[std::size_t(a)], circles[std::size_t(b)])) {
      corners.push_back(choose(*meeting, circles[std::size_t(third)]));
    }
  }
  if (corners.empty()) return fix;  // all three landmarks in one place: one landmark, not three

  // For tied corners one choice is made for all: each further tied corner joins the answer to which it is nearer.
  std::vector<Eigen::Vector2d> first;
  std::vector<Eigen::Vector2d> second;
  bool tied = false;
  for (const Corner& corner : corners) {
    Eigen::Vector2d mine = corner.chosen_m;
    Eigen::Vector2d theirs = corner.other_m;
    if (corner.tied && tied && (mine - mean(first)).norm() > (theirs - mean(first)).norm()) std::swap(mine, theirs);
    first.push_back(mine);
    second.push_back(theirs);
    tied = tied || corner.tied;
  }
  fix.used = 3;
  fix.position_m = origin + mean(first) * unit_m;
  fix.verdict = std::ranges::any_of(corners, &Corner::gap) ? FixVerdict::kGap : FixVerdict::kOk;
  if (tied) {
    fix.other_position_m = origin + mean(second) * unit_m;
    fix.verdict = FixVerdict::kAmbiguous;
  }
  return fix;
}

}  // namespace twocone::localisation

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <functional>
#include <set>

#include "apps/tradeoff/conclusions.h"

namespace twocone::tradeoff {
namespace {

/// Added to each point's own sigma. No law is more accurate, and a time that is always the same would otherwise
/// outweigh all other points.
constexpr double kLeastSigma = 0.01;

struct Point {
  double x = 0, y = 0;  ///< logarithms
  double weight = 0;
};

std::vector<Point> points_of(const AxisGroup& group, const std::function<Interval(const SettingResult&)>& figure) {
  const double z = boost::math::quantile(boost::math::normal(), (1 + kConfidence) / 2);
  std::vector<Point> points;
  for (const auto& [place, result] : group) {
    const Interval f = figure(*result);
    if (!(f.low > 0 && std::isfinite(f.high) && place.first > 0)) continue;
    const double sigma = std::log(f.high / f.low) / (2 * z);
    points.push_back({std::log(place.first), std::log(f.value), 1 / (sigma * sigma + kLeastSigma * kLeastSigma)});
  }
  return points;
}

/// Fits one exponent to all groups, each with its own factor.
std::optional<Growth> fit(const std::vector<std::vector<Point>>& groups) {
  double xx = 0, xy = 0, yy = 0;
  int points = 0, used = 0;
  for (const auto& group : groups) {
    const auto differs = [&group](const Point& p) { return p.x != group.front().x; };
    if (std::none_of(group.begin(), group.end(), differs)) continue;
    double weights = 0, x = 0, y = 0;
    for (const Point& p : group) {
      weights += p.weight;
      x += p.weight * p.x;
      y += p.weight * p.y;
    }
    x /= weights;
    y /= weights;
    for (const Point& p : group) {
      xx += p.weight * (p.x - x) * (p.x - x);
      xy += p.weight * (p.x - x) * (p.y - y);
      yy += p.weight * (p.y - y) * (p.y - y);
    }
    points += int(group.size());
    ++used;
  }
  if (used == 0) return std::nullopt;
  Growth growth;
  growth.exponent = xy / xx;
  growth.points = points;
  double half = boost::math::quantile(boost::math::normal(), (1 + kConfidence) / 2) / std::sqrt(xx);
  if (const int freedom = points - used - 1; freedom > 0) {
    // Where the growth is no power law, points scatter about it by more than their own intervals.
    const double scatter = std::max(0.0, yy - growth.exponent * xy) / freedom;
    const double t = boost::math::quantile(boost::math::students_t(freedom), (1 + kConfidence) / 2);
    half = std::max(half, t * std::sqrt(scatter / xx));
  }
  growth.low = growth.exponent - half;
  growth.high = growth.exponent + half;
  return growth;
}

/// Returns the first setting of each set of images, reduced to the images, because rendering is timed once for all
/// settings of them.
Sweep of_images(const Sweep& sweep) {
  Sweep images;
  std::set<Images> seen;
  for (SettingResult result : sweep.settings) {
    if (!answers_enough(result) || !seen.insert(result.setting.images).second) continue;
    result.setting = {.images = result.setting.images};
    images.settings.push_back(result);
  }
  return images;
}

}  // namespace

std::vector<Growth> growth(const Sweep& sweep) {
  const auto error = [](const SettingResult& s) { return s.position_m->mean; };
  const auto vision = [](const SettingResult& s) { return s.vision.median_s; };
  const auto rendering = [](const SettingResult& s) { return s.render_cpu.median_s; };
  const Sweep images = of_images(sweep);
  struct Law {
    const Sweep& sweep;
    Axis axis;
    const char* of;
    std::function<Interval(const SettingResult&)> figure;
  };
  std::vector<Growth> all;
  for (const Law& law :
       {Law{sweep, Axis::kSize, "position error", error}, Law{sweep, Axis::kSize, "vision time", vision},
        Law{images, Axis::kSize, "rendering time", rendering}, Law{sweep, Axis::kLandmarks, "position error", error},
        Law{sweep, Axis::kLandmarks, "vision time", vision}, Law{sweep, Axis::kFrames, "position error", error}}) {
    std::vector<std::vector<Point>> points;
    for (const AxisGroup& group : axis_groups(law.sweep, law.axis)) points.push_back(points_of(group, law.figure));
    if (auto found = fit(points)) {
      found->axis = law.axis;
      found->of = law.of;
      all.push_back(*found);
    }
  }
  return all;
}

}  // namespace twocone::tradeoff

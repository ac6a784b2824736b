// SPDX-License-Identifier: Apache-2.0
#include "localisation/least_squares/problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <boost/container/static_vector.hpp>

#include "localisation/covariance.h"

namespace twocone::localisation::least_squares {
namespace {

/// The information of a range with a sigma of this many sizes of the problem is lost in the rounding of doubles.
constexpr double kNoInformation = 1e8;

/// The standard deviation of a uniformly distributed angle: pi / sqrt(3). A Gaussian of that width or more on the
/// circle gives no information either.
constexpr double kAnyDirection_rad = 1.8137993642342178;

bool is_variance(double v) { return v > 0 && std::isfinite(v); }

double correlation_of(const Eigen::Matrix2d& c) {
  // Take the roots first: the product of two variances may overflow where the correlation does not.
  return c(0, 1) / std::sqrt(c(0, 0)) / std::sqrt(c(1, 1));
}

bool is_usable(const LandmarkMeasurement& m) {
  if (!m.range_m && !m.bearing_rad) return false;
  if (!m.landmark_m.allFinite()) return false;
  if (m.range_m && !(std::isfinite(*m.range_m) && *m.range_m >= 0 && is_variance(m.covariance(0, 0)))) return false;
  if (m.bearing_rad && !(std::isfinite(*m.bearing_rad) && is_variance(m.covariance(1, 1)))) return false;
  return !m.range_m || !m.bearing_rad || is_covariance<2>(m.covariance);
}

double weight(const Landmark& l) {
  return std::max(l.has_range ? l.range_weight : 0, l.has_bearing ? l.bearing_weight : 0);
}

/// Counts the distinct places of the chosen landmarks, up to three.
template <typename Chosen>
int count_places(std::span<const Landmark> landmarks, double rounding, Chosen is_chosen) {
  boost::container::static_vector<Eigen::Vector2d, 3> seen;
  for (const Landmark& l : landmarks) {
    // Each coordinate was rounded twice: where it was written, and when it was recentred.
    const auto is_here = [&](const Eigen::Vector2d& p) {
      return (l.place() - p).cwiseAbs().maxCoeff() <= 2 * rounding;
    };
    if (!std::invoke(is_chosen, l) || std::any_of(seen.begin(), seen.end(), is_here)) continue;
    seen.push_back(l.place());
    if (seen.size() == seen.capacity()) break;
  }
  return int(seen.size());
}

}  // namespace

int prepare(std::span<const LandmarkMeasurement> measurements, Frame& frame, Landmark* landmarks) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  Eigen::Vector2d low(kInf, kInf);
  Eigen::Vector2d high(-kInf, -kInf);
  double longest_m = 0;
  int count = 0;
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    const LandmarkMeasurement& m = measurements[i];
    if (!is_usable(m)) continue;
    low = low.cwiseMin(m.landmark_m);
    high = high.cwiseMax(m.landmark_m);
    if (m.range_m) longest_m = std::max(longest_m, *m.range_m);
    landmarks[count++].index = int(i);
  }
  if (count == 0) return 0;
  frame.origin_m = low / 2 + high / 2;  // halved first: the sum of two huge ones overflows
  const double size_m = std::max({high.x() - frame.origin_m.x(), high.y() - frame.origin_m.y(), longest_m});
  // The scale is limited because a double must hold its inverse.
  const int exponent = size_m > 0 ? std::clamp(std::ilogb(size_m), -1000, 1000) : 0;
  frame.unit_m = std::ldexp(1, exponent);
  const double per_m = std::ldexp(1, -exponent);
  const double farthest_m = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
  frame.rounding = kEps * (farthest_m * per_m + 1);

  int kept = 0;
  for (int k = 0; k < count; ++k) {
    Landmark l{.index = landmarks[k].index};
    const LandmarkMeasurement& m = measurements[std::size_t(l.index)];
    l.has_range = m.range_m.has_value();
    l.has_bearing = m.bearing_rad.has_value() && m.covariance(1, 1) < kAnyDirection_rad * kAnyDirection_rad;
    if (l.numbers() == 0) continue;
    l.x = (m.landmark_m.x() - frame.origin_m.x()) * per_m;
    l.y = (m.landmark_m.y() - frame.origin_m.y()) * per_m;
    double stated = 0;
    double sigma = 0;
    if (l.has_range) {
      l.range = *m.range_m * per_m;
      // No range is more accurate than the doubles that hold it and its landmark.
      stated = std::sqrt(m.covariance(0, 0)) * per_m;
      sigma = std::sqrt(stated * stated + frame.rounding * frame.rounding);
      l.range_weight = 1 / sigma;
    }
    if (l.has_bearing) {
      l.cos_bearing = std::cos(*m.bearing_rad);
      l.sin_bearing = std::sin(*m.bearing_rad);
      l.sigma_bearing_rad = std::sqrt(m.covariance(1, 1) + kEps * kEps);
      const double correlation = l.has_range ? correlation_of(m.covariance) * (stated / sigma) : 0;
      l.bearing_on_range = correlation * l.sigma_bearing_rad;
      l.bearing_weight = 1 / (l.sigma_bearing_rad * std::sqrt((1 - correlation) * (1 + correlation)));
    }
    if (sigma > kNoInformation) continue;
    landmarks[kept++] = l;
  }
  // Equal weights keep their order. (std::stable_sort would take memory from the heap.)
  const auto rank = [](const Landmark& l) { return std::pair(-weight(l), l.index); };
  std::ranges::sort(landmarks, landmarks + kept, {}, rank);
  return kept;
}

Problem make_problem(std::span<const Landmark> landmarks, double rounding) {
  Problem p{.landmarks = landmarks, .rounding = rounding};
  for (const Landmark& l : landmarks) p.numbers += l.numbers();
  p.places.all = count_places(landmarks, rounding, [](const Landmark& /*l*/) { return true; });
  p.places.ranged = count_places(landmarks, rounding, &Landmark::has_range);
  p.places.bearing = count_places(landmarks, rounding, &Landmark::has_bearing);
  p.places.both = count_places(landmarks, rounding, [](const Landmark& l) { return l.has_range && l.has_bearing; });
  p.has_heading = p.places.bearing > 0;
  return p;
}

}  // namespace twocone::localisation::least_squares

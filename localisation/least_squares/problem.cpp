// SPDX-License-Identifier: Apache-2.0
#include "localisation/least_squares/problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
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

/// Returns the mean variance, over all directions, of the landmark's place.
double place_variance_m2(const LandmarkMeasurement& m) { return m.place_by_shared.squaredNorm() / 2; }

/// Returns the variances that the place adds to (range m, bearing rad) if it is equally uncertain in all directions.
/// The distance of a landmark without a range is not known here: its bearing gets nothing.
Eigen::Vector2d place_variances(const LandmarkMeasurement& m) {
  const double variance_m2 = place_variance_m2(m);
  const bool is_distant = m.range_m && *m.range_m > 0;
  return {variance_m2, is_distant ? variance_m2 / *m.range_m / *m.range_m : 0};
}

/// Returns the covariance of (range m, bearing rad) from all sources.
Eigen::Matrix2d whole_covariance(const LandmarkMeasurement& m) {
  Eigen::Matrix2d whole = m.covariance;
  if (m.by_shared.cols() > 0) whole += m.by_shared * m.by_shared.transpose();
  if (m.place_by_shared.cols() > 0) whole.diagonal() += place_variances(m);
  return whole;
}

bool is_usable(const LandmarkMeasurement& m) {
  if (!m.range_m && !m.bearing_rad) return false;
  if (!m.landmark_m.allFinite()) return false;
  if (m.range_m && !(std::isfinite(*m.range_m) && *m.range_m >= 0 && is_variance(m.covariance(0, 0)))) return false;
  if (m.bearing_rad && !(std::isfinite(*m.bearing_rad) && is_variance(m.covariance(1, 1)))) return false;
  if (!m.by_shared.allFinite() || !m.place_by_shared.allFinite()) return false;
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
    const Eigen::Matrix2d covariance = whole_covariance(m);
    l.has_range = m.range_m.has_value();
    l.has_bearing = m.bearing_rad.has_value() && covariance(1, 1) < kAnyDirection_rad * kAnyDirection_rad;
    if (l.numbers() == 0) continue;
    l.x = (m.landmark_m.x() - frame.origin_m.x()) * per_m;
    l.y = (m.landmark_m.y() - frame.origin_m.y()) * per_m;
    double stated = 0;
    double sigma = 0;
    if (l.has_range) {
      l.range = *m.range_m * per_m;
      // No range is more accurate than the doubles that hold it and its landmark.
      stated = std::sqrt(covariance(0, 0)) * per_m;
      sigma = std::sqrt(stated * stated + frame.rounding * frame.rounding);
      l.range_weight = 1 / sigma;
    }
    if (l.has_bearing) {
      l.cos_bearing = std::cos(*m.bearing_rad);
      l.sin_bearing = std::sin(*m.bearing_rad);
      l.sigma_bearing_rad = std::sqrt(covariance(1, 1) + kEps * kEps);
      const double correlation = l.has_range ? correlation_of(covariance) * (stated / sigma) : 0;
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

namespace {

/// Returns the effect of the shared errors on measured minus predicted (range in units, bearing rad) of a landmark.
BySharedErrors<2> effect_of(const SharedErrors& shared, const Landmark& l) {
  const LandmarkMeasurement& m = shared.measurements[std::size_t(l.index)];
  const double per_m = 1 / shared.frame.unit_m;
  BySharedErrors<2> effect = BySharedErrors<2>::Zero(2, shared.count());
  if (m.by_shared.cols() > 0) {
    effect.row(0) = m.by_shared.row(0) * per_m;
    effect.row(1) = m.by_shared.row(1);
  }
  if (m.place_by_shared.cols() == 0 || !shared.seen_from) return effect;
  const Eigen::Vector2d to = l.place() - Eigen::Vector2d(shared.seen_from->x, shared.seen_from->y);
  const double distance = to.norm();
  if (!(distance > shared.frame.rounding)) return effect;  // seen from its own place, it has no direction
  const Eigen::RowVector2d outwards = to.transpose() / distance;
  const Eigen::RowVector2d sideways(-outwards.y(), outwards.x());
  effect.row(0) += outwards * m.place_by_shared * per_m;
  effect.row(1) += sideways * m.place_by_shared * (per_m / distance);
  return effect;
}

/// Returns the covariance of a landmark's own noise, (range in units, bearing rad), with the rounding of its numbers.
Eigen::Matrix2d own_covariance(const SharedErrors& shared, const Landmark& l) {
  const LandmarkMeasurement& m = shared.measurements[std::size_t(l.index)];
  const double per_m = 1 / shared.frame.unit_m;
  const Eigen::Vector2d unit(per_m, 1);
  Eigen::Matrix2d own = unit.asDiagonal() * m.covariance * unit.asDiagonal();
  own(0, 0) += shared.frame.rounding * shared.frame.rounding;
  own(1, 1) += kEps * kEps;
  if (!shared.seen_from && m.place_by_shared.cols() > 0) {
    own.diagonal() += unit.cwiseAbs2().cwiseProduct(place_variances(m));
  }
  return own;
}

/// Returns the inverse of the lower Cholesky factor of the covariance of all numbers.
Eigen::MatrixXd joint_whitener(const NumberErrors& errors) {
  const Eigen::Index numbers = errors.own.rows();
  Eigen::MatrixXd covariance = errors.own + errors.by_shared * errors.by_shared.transpose();
  // The sum of the shared errors' products is rounded. Without this addition, numbers whose own noise is below that
  // rounding would make the matrix indefinite.
  covariance.diagonal() *= 1 + double(numbers + 8) * kEps;
  const Eigen::LLT<Eigen::MatrixXd> llt(covariance);
  return llt.matrixL().solve(Eigen::MatrixXd::Identity(numbers, numbers));
}

}  // namespace

bool SharedErrors::any() const { return count() > 0; }

Eigen::Index SharedErrors::count() const {
  Eigen::Index count = 0;
  for (const LandmarkMeasurement& m : measurements) {
    count = std::max({count, m.by_shared.cols(), m.place_by_shared.cols()});
  }
  return count;
}

NumberErrors errors_of_numbers(std::span<const Landmark> landmarks, const SharedErrors& shared) {
  Eigen::Index numbers = 0;
  for (const Landmark& l : landmarks) numbers += l.numbers();
  NumberErrors errors{Eigen::MatrixXd::Zero(numbers, numbers), Eigen::MatrixXd(numbers, shared.count())};
  Eigen::Index row = 0;
  for (const Landmark& l : landmarks) {
    const int first = l.has_range ? 0 : 1;
    const int n = l.numbers();
    errors.own.block(row, row, n, n) = own_covariance(shared, l).block(first, first, n, n);
    errors.by_shared.middleRows(row, n) = effect_of(shared, l).middleRows(first, n);
    row += n;
  }
  return errors;
}

Problem make_problem(std::span<const Landmark> landmarks, double rounding, const SharedErrors* shared) {
  Problem p{.landmarks = landmarks, .rounding = rounding, .shared = shared};
  for (const Landmark& l : landmarks) p.numbers += l.numbers();
  p.places.all = count_places(landmarks, rounding, [](const Landmark& /*l*/) { return true; });
  p.places.ranged = count_places(landmarks, rounding, &Landmark::has_range);
  p.places.bearing = count_places(landmarks, rounding, &Landmark::has_bearing);
  p.places.both = count_places(landmarks, rounding, [](const Landmark& l) { return l.has_range && l.has_bearing; });
  p.has_heading = p.places.bearing > 0;
  if (shared != nullptr && p.numbers > 0) {
    p.whitener = joint_whitener(errors_of_numbers(landmarks, *shared));
  }
  return p;
}

}  // namespace twocone::localisation::least_squares

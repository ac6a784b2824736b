// SPDX-License-Identifier: Apache-2.0
#include "localisation/least_squares/answer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "localisation/chi_squared.h"
#include "localisation/least_squares/starts.h"

namespace twocone::localisation::least_squares {
namespace {

/// Past so many sizes of the problem a minimum runs away to infinity.
constexpr double kFarAway = 1e6;

/// The distinct minima, the lowest first.
class Minima {
 public:
  void add(const Minimum& m) {
    if (!std::isfinite(m.cost) || std::hypot(m.state.x, m.state.y) > kFarAway) return;
    // The same one reached twice differs by what ends the steps; a flat one's ends are joined later.
    constexpr double kSame = 1e-9;
    int at = 0;
    for (; at < count_; ++at) {
      const Minimum& known = minima_[std::size_t(at)];
      const double apart = step_between(known.state, m.state).cwiseAbs().maxCoeff();
      if (apart < kSame * (1 + std::hypot(m.state.x, m.state.y)) && known.converged) return;
      if (m.cost < known.cost) break;
    }
    if (at == kMost) return;
    count_ = std::min(count_ + 1, kMost);
    std::move_backward(minima_.begin() + at, minima_.begin() + count_ - 1, minima_.begin() + count_);
    minima_[std::size_t(at)] = m;
  }
  [[nodiscard]] std::span<const Minimum> all() const { return {minima_.data(), std::size_t(count_)}; }

 private:
  static constexpr int kMost = 8;
  std::array<Minimum, kMost> minima_;
  int count_ = 0;
};

State middle(const State& a, const State& b) { return moved(a, step_between(a, b) / 2); }

/// Whether no ridge stands between two minima. Looked at in three places: of two wells' halves, one may lie beyond the
/// top.
bool are_joined(const Problem& problem, const Minimum& a, const Minimum& b) {
  const Eigen::Vector3d step = step_between(a.state, b.state);
  for (const double t : {0.25, 0.5, 0.75}) {
    if (!(cost_at(problem, moved(a.state, step * t)) < std::max(a.cost, b.cost) + kRidge)) return false;
  }
  return true;
}

bool has_full_rank(const Factor& f, int unknowns) {
  double determinant = 1;
  for (int k = 0; k < unknowns; ++k) determinant *= f.norm[k] > 0 ? f.r(k, k) / f.norm[k] : 0;
  // With columns of norm 1 no singular value passes sqrt(3), so the least is a third of the determinant or more.
  if (std::abs(determinant) > 1e-6) return true;
  return directions(f, unknowns).rank() == unknowns;
}

Eigen::Matrix3d covariance_of(const Factor& f, int unknowns) {
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  for (int k = 0; k < unknowns; ++k) {
    inverse(k, k) = 1 / f.r(k, k);
    for (int i = k - 1; i >= 0; --i) {
      double rest = 0;
      for (int j = i + 1; j <= k; ++j) rest -= f.r(i, j) * inverse(j, k);
      inverse(i, k) = rest / f.r(i, i);
    }
  }
  return inverse * inverse.transpose();
}

/// The factor that a covariance at a minimum may rest on: without the gradient of a landmark that is nearer than the
/// position is known. Which way it lies is not known then (T16: the robot stands on it).
Factor first_order_factor(const Problem& problem, const Minimum& m) {
  const int unknowns = problem.unknowns();
  if (!has_full_rank(m.factor, unknowns)) return m.factor;
  const Eigen::Matrix3d covariance = covariance_of(m.factor, unknowns);
  const double reach = std::sqrt(covariance(0, 0) + covariance(1, 1));
  for (const Landmark& l : problem.landmarks) {
    if (std::hypot(l.x - m.state.x, l.y - m.state.y) > reach) continue;
    Factor f;
    linearise(problem, m.state, reach, f);
    return f;
  }
  return m.factor;
}

/// Whether chi-squared three sigmas out along the least seen direction is the 9 that its slope promises: not below half
/// of that, where the ellipse would be too small, nor beyond four times it (twice is what a landmark adds on which the
/// robot stands, which the ellipse does without).
bool is_first_order(const Problem& problem, const Minimum& m, const Factor& f, const Eigen::Matrix3d& covariance) {
  const int unknowns = problem.unknowns();
  // What the rows' curvature adds at one sigma, at most, whitened: nearly always so little that no direction need be
  // tried.
  const double spread = covariance(0, 0) + covariance(1, 1);
  double curved = 0;
  for (const Landmark& l : problem.landmarks) {
    const double dx = l.x - m.state.x;
    const double dy = l.y - m.state.y;
    const double distance2 = dx * dx + dy * dy;
    if (l.has_range) curved += spread * spread * l.range_weight * l.range_weight / (4 * distance2);
    if (l.has_bearing) {
      const double bend = spread * l.bearing_weight / (2 * distance2);
      curved += bend * bend;
    }
  }
  if (curved < 1e-3 && covariance(2, 2) < 0.01) return true;
  const Directions d = directions(f, unknowns);
  const int last = unknowns - 1;
  const Eigen::Vector3d step = 3 * d.v.col(last).cwiseProduct(d.scale) / d.singular[last];
  if (std::abs(step.z()) > 1.5) return false;  // a heading within a turn's half has no straight axis of that length
  for (const double side : {-1.0, 1.0}) {
    const double rise = cost_at(problem, moved(m.state, side * step)) - m.cost;
    if (!(rise > 9 / 2.0 && rise < 9 * 4.0)) return false;
  }
  return true;
}

Answer nothing(FixVerdict verdict) {
  Answer a;
  a.verdict = verdict;
  return a;
}

Answer weak_answer(const Problem& problem, const Minimum& best, const State& between) {
  const int unknowns = problem.unknowns();
  Minimum m = minimise_across(problem, between);
  if (!m.converged || !(m.cost < best.cost + kRidge)) m = minimise_across(problem, best.state);
  if (!m.converged || !(m.cost < best.cost + kRidge)) m = best;
  const Directions d = directions(first_order_factor(problem, m), unknowns);
  if (d.rank() < unknowns - 1) return nothing(FixVerdict::kTooFew);
  Answer a;
  a.verdict = FixVerdict::kWeak;
  a.minimum = m;
  a.place.state = m.state;
  for (int k = 0; k < unknowns - 1; ++k) {
    const Eigen::Vector3d axis = d.v.col(k).cwiseProduct(d.scale) / d.singular[k];
    a.place.covariance += axis * axis.transpose();
  }
  a.unseen = d.v.col(unknowns - 1).cwiseProduct(d.scale).normalized();
  a.chi_squared = m.cost;
  a.degrees_of_freedom = problem.numbers - (unknowns - 1);
  return a;
}

Answer weigh(const Problem& problem, const Minima& minima) {
  const int unknowns = problem.unknowns();
  const std::span<const Minimum> all = minima.all();
  if (all.empty()) return nothing(FixVerdict::kContradictory);
  const Minimum& best = all.front();
  const Minimum* other = nullptr;
  const Minimum* joined = nullptr;
  for (const Minimum& m : all.subspan(1)) {
    if (!(m.cost < best.cost - 2 * std::log(kOtherIsRight))) break;
    if (are_joined(problem, best, m)) {
      if (!joined) joined = &m;
    } else if (!other) {
      other = &m;
    } else if (!are_joined(problem, *other, m)) {
      return nothing(FixVerdict::kTooFew);  // three answers: more than these measurements can be said to determine
    }
  }
  const auto place_at = [&](const Minimum& m, Place& place) {
    const Factor f = first_order_factor(problem, m);
    if (!m.converged || !has_full_rank(f, unknowns)) return false;
    place = {m.state, covariance_of(f, unknowns)};
    return is_first_order(problem, m, f, place.covariance);
  };
  Answer a;
  a.minimum = best;
  // Ends of one valley: farther apart than the ellipse of either says.
  const bool is_valley =
      joined != nullptr && (best.factor.r * step_between(best.state, joined->state)).squaredNorm() > 1;
  if (is_valley || !place_at(best, a.place)) {
    return weak_answer(problem, best, joined ? middle(best.state, joined->state) : best.state);
  }
  a.verdict = FixVerdict::kOk;
  a.chi_squared = best.cost;
  a.degrees_of_freedom = problem.numbers - unknowns;
  if (other) {
    a.verdict = FixVerdict::kAmbiguous;
    Place place;
    if (!place_at(*other, place)) return nothing(FixVerdict::kTooFew);
    a.other = place;
  }
  return a;
}

bool is_consistent(const Problem& problem, const Answer& a) {
  if (chi_squared_tail(a.chi_squared, std::max(1, a.degrees_of_freedom)) < kFalseAlarm) return false;
  if (a.degrees_of_freedom < 1 || a.verdict == FixVerdict::kWeak) return true;
  const double largest = leave_one_out(problem, a.minimum, nullptr);
  // exp(-t / 2) is the tail of two numbers, and more than that of one.
  return std::exp(-largest / 2) * double(problem.landmarks.size()) >= kFalseAlarm;
}

}  // namespace

Answer solve(const Problem& problem) {
  if (!problem.is_enough()) return nothing(FixVerdict::kTooFew);
  Minima minima;
  Starts starts;
  bool is_settled = false;
  if (problem.places.both >= 2) {
    const Alignment alignment = align(problem);
    const Minimum m = minimise(problem, alignment.state);
    minima.add(m);
    // All poses that would be given beside this one lie within acos(0.99) = 8 degrees of it: one valley.
    is_settled = m.converged && alignment.strength > 50 * (m.cost - 2 * std::log(kOtherIsRight));
  }
  if (!is_settled) {
    add_starts(problem, starts);
    for (const State& s : starts.all()) minima.add(minimise(problem, s));
  }
  Answer a = weigh(problem, minima);
  if (a.verdict != FixVerdict::kTooFew && a.verdict != FixVerdict::kContradictory) {
    a.is_consistent = is_consistent(problem, a);
  }
  return a;
}

}  // namespace twocone::localisation::least_squares

// SPDX-License-Identifier: Apache-2.0
#include "localisation/least_squares/answer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include <boost/container/static_vector.hpp>

#include "localisation/chi_squared.h"
#include "localisation/least_squares/starts.h"

namespace twocone::localisation::least_squares {
namespace {

/// Largest relative error of first order in the rise of chi-squared from a minimum, where there is one minimum only.
constexpr double kExplained = 0.1;

/// A closed-form start is abandoned if chi-squared is above this many times the limit after a dozen steps from it.
constexpr double kWorth = 1e3;

/// Beyond this many sizes of the problem a minimum diverges to infinity.
constexpr double kFarAway = 1e6;

/// The distinct minima, the lowest first.
class Minima {
 public:
  void add(const Minimum& m) {
    if (!std::isfinite(m.cost) || std::hypot(m.state.x, m.state.y) > kFarAway) return;
    // A minimum that did not converge is kept only until another is found.
    if (!minima_.empty() && !m.converged) return;
    if (!minima_.empty() && !minima_.front().converged) minima_.clear();
    // Two results for one minimum differ by the limit of the last step. The ends of a flat minimum are joined later.
    constexpr double kSame = 1e-9;
    auto at = minima_.begin();
    for (; at != minima_.end(); ++at) {
      const double apart = step_between(at->state, m.state).cwiseAbs().maxCoeff();
      if (apart < kSame * (1 + std::hypot(m.state.x, m.state.y)) && at->converged) return;
      if (m.cost < at->cost) break;
    }
    if (minima_.size() == minima_.capacity()) {
      if (at == minima_.end()) return;
      minima_.pop_back();
    }
    minima_.insert(at, m);
  }
  [[nodiscard]] std::span<const Minimum> all() const { return {minima_.data(), minima_.size()}; }

 private:
  boost::container::static_vector<Minimum, 8> minima_;
};

State middle(const State& a, const State& b) { return moved(a, step_between(a, b) / 2); }

/// Returns whether there is no ridge between two minima. Three places are tested, because in two unequal wells the
/// middle may be beyond the top.
bool are_joined(const Problem& problem, const Minimum& a, const Minimum& b) {
  const Eigen::Vector3d step = step_between(a.state, b.state);
  for (const double t : {0.25, 0.5, 0.75}) {
    if (!(cost_at(problem, moved(a.state, step * t)) < std::max(a.cost, b.cost) + kRidge)) return false;
  }
  return true;
}

bool has_full_rank(const Factor& f, int unknowns) {
  const Eigen::Vector3d scale = scale_of(f, unknowns);
  double determinant = 1;
  for (int k = 0; k < unknowns; ++k) determinant *= f.r(k, k) * scale[k];
  // With columns of norm 1 or less no singular value exceeds sqrt(3), so the least is at least a third of the
  // determinant.
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

/// Returns the factor of a minimum without the gradients of landmarks within `reach`, the uncertainty of the position.
/// The direction of such a landmark is unknown (T16: the robot is at its place).
Factor factor_beyond(const Problem& problem, const Minimum& m, double reach) {
  for (const Landmark& l : problem.landmarks) {
    if (std::hypot(l.x - m.state.x, l.y - m.state.y) <= reach) return linearise(problem, m.state, reach).factor;
  }
  return m.factor;
}

/// Returns the factor for the covariance at a minimum.
Factor first_order_factor(const Problem& problem, const Minimum& m) {
  const int unknowns = problem.unknowns();
  if (!has_full_rank(m.factor, unknowns)) return m.factor;
  const Eigen::Matrix3d covariance = covariance_of(m.factor, unknowns);
  return factor_beyond(problem, m, std::sqrt(covariance(0, 0) + covariance(1, 1)));
}

/// Returns the covariance of all directions except the least observed one.
Eigen::Matrix3d covariance_across(const Directions& d) {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (int k = 0; k < d.unknowns - 1; ++k) {
    const Eigen::Vector3d axis = d.v.col(k).cwiseProduct(d.scale) / d.singular[k];
    covariance += axis * axis.transpose();
  }
  return covariance;
}

/// Returns whether chi-squared three sigmas out along the least observed direction is near the 9 of a parabola. It may
/// not be below half of that, where the ellipse would be too small, or above four times that (a landmark at the robot's
/// place, which the ellipse leaves out, adds twice as much).
bool is_first_order(const Problem& problem, const Minimum& m, const Factor& f, const Eigen::Matrix3d& covariance) {
  const int unknowns = problem.unknowns();
  // Compute an upper bound of the rows' curvature at one sigma, whitened. It is nearly always so small that no
  // direction needs a test.
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
  if (std::abs(step.z()) > 1.5) return false;  // a heading, limited to half a turn, has no straight axis of that length
  for (const double side : {-1.0, 1.0}) {
    const double rise = cost_at(problem, moved(m.state, side * step)) - m.cost;
    if (!(rise > 9 / 2.0 && rise < 9 * 4.0)) return false;
  }
  return true;
}

/// Returns the limit of chi-squared above which a set is neither consistent nor one whose sigmas are too small. It uses
/// Laurent and Massart's bound of the quantile (2000, lemma 1).
double largest_believed(const Problem& problem) {
  const double n = std::max(1, problem.numbers - problem.unknowns());
  const double x = -std::log(kFalseAlarm);
  return std::max(n + 2 * std::sqrt(n * x) + 2 * x, kMostRatio * n);
}

/// Returns the limit of chi-squared above which no minimum matters.
double limit_of(const Problem& problem, const Minima& minima) {
  const double best = minima.all().empty() ? std::numeric_limits<double>::infinity() : minima.all().front().cost;
  return std::min(best, largest_believed(problem)) + kRival;
}

/// Adds every minimum that could be the answer or its rival. @returns whether the search was complete
bool add_searched(const Problem& problem, Minima& minima) {
  // Limit for cells that could not be made small; the lowest come first.
  constexpr int kMostCoarse = 256;
  const double limit = limit_of(problem, minima);
  int coarse = 0;
  bool is_all = true;
  for (const Cell& cell : cells_below(problem, limit)) {
    // A cell whose chi-squared is that of a known minimum's parabola holds no other minimum.
    const auto is_explained_by = [&](const Minimum& m) {
      const double rise = (m.factor.r * step_between(m.state, cell.middle)).squaredNorm();
      return m.converged && std::abs(m.cost + rise - cell.cost) <= kExplained * (1 + rise);
    };
    if (std::ranges::any_of(minima.all(), is_explained_by)) continue;
    if (cell.is_small && !may_hold_minimum(problem, cell.middle, cell.reach, cell.is_fine)) continue;
    if (!cell.is_small && ++coarse > kMostCoarse) {
      is_all = false;
      continue;
    }
    minima.add(minimise(problem, cell.middle, kWorth * limit));
  }
  return is_all;
}

Answer nothing(FixVerdict verdict) {
  Answer a;
  a.verdict = verdict;
  return a;
}

/// Computes the mean square, along `unseen`, of the places on the floor of a valley, weighted by their likelihood
/// exp(-chi-squared / 2). In a direction along which chi-squared is no parabola, a Gaussian can represent no more than
/// this. The floor is followed in both directions, because it bends.
double variance_along(const Problem& problem, const Minimum& place, const Eigen::Vector3d& unseen) {
  constexpr double kSteps = 4;        // steps per width: a step is a quarter of the width
  constexpr int kMostWidths = 16;     // in each direction; if chi-squared has not risen by then, it is no Gaussian
  constexpr double kNegligible = 25;  // a rise of chi-squared: exp(-25 / 2) = 4e-6
  const int unknowns = problem.unknowns();
  const auto rise_at = [&](double t) { return cost_at(problem, moved(place.state, t * unseen)) - place.cost; };
  const double bend = bend_along(problem, place, unseen);
  double width = bend > 1 ? 1 / std::sqrt(bend) : 1;
  const auto floor_rise = [&](double t) {
    const Minimum m = minimise_across(problem, moved(place.state, t * unseen));
    return m.converged ? m.cost - place.cost : rise_at(t);
  };
  // Reduce the width until chi-squared rises by some 1 to 4 over it.
  for (int i = 0; i < 100 && std::max(floor_rise(width), floor_rise(-width)) > 4; ++i) width /= 2;
  double weights = 1;
  double sum = 0;
  for (const double side : {-1.0, 1.0}) {
    State at = place.state;
    Eigen::Vector3d ahead = side * unseen;
    for (int i = 0; i < kMostWidths * int(kSteps); ++i) {
      const Minimum m = minimise_across(problem, moved(at, ahead * (width / kSteps)));
      const double rise = m.cost - place.cost;
      if (!m.converged || rise > kNegligible) break;
      const double t = unseen.dot(step_between(place.state, m.state));
      const double weight = std::exp(-std::max(0.0, rise) / 2);
      weights += weight;
      sum += weight * t * t;
      const Directions d = directions(m.factor, unknowns);
      const Eigen::Vector3d next = d.v.col(unknowns - 1).cwiseProduct(d.scale).normalized();
      ahead = next.dot(ahead) < 0 ? -next : next;
      at = m.state;
    }
  }
  return sum / weights;
}

/// @param between the middle of two minima where they are ends of one valley
Answer weak_answer(const Problem& problem, const Minimum& best, const std::optional<State>& between) {
  const int unknowns = problem.unknowns();
  Minimum m = best;
  if (between || !best.converged) {
    const Minimum across = minimise_across(problem, between.value_or(best.state));
    if (across.converged && across.cost < best.cost + kRidge) m = across;
  }
  Directions d = directions(m.factor, unknowns);
  if (d.rank() < unknowns - 1) return nothing(FixVerdict::kTooFew);
  const Eigen::Matrix3d across = covariance_across(d);
  const Directions beyond = directions(factor_beyond(problem, m, std::sqrt(across(0, 0) + across(1, 1))), unknowns);
  if (beyond.rank() == unknowns - 1) d = beyond;
  Answer a;
  a.verdict = FixVerdict::kWeak;
  a.minimum = m;
  a.place = {m.state, covariance_across(d)};
  a.unseen = d.v.col(unknowns - 1).cwiseProduct(d.scale).normalized();
  a.place.covariance += variance_along(problem, m, *a.unseen) * *a.unseen * a.unseen->transpose();
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
    if (!(m.cost <= best.cost + kRival)) break;
    if (are_joined(problem, best, m)) {
      if (!joined) joined = &m;
    } else if (!other) {
      other = &m;
    } else if (!are_joined(problem, *other, m)) {
      return nothing(FixVerdict::kTooFew);  // three answers: these measurements do not determine a position
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
  // Distinguishes two ends of one valley from one minimum that was reached twice.
  constexpr double kOneMinimum = 1e-3;  // sigmas^2
  const bool is_valley =
      joined != nullptr && (best.factor.r * step_between(best.state, joined->state)).squaredNorm() > kOneMinimum;
  if (is_valley || !place_at(best, a.place)) {
    return weak_answer(problem, best, joined ? std::optional(middle(best.state, joined->state)) : std::nullopt);
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
  const double largest = forecast(problem, a.minimum, nullptr, nullptr);
  // exp(-t / 2) is the tail for two numbers, and larger than that for one.
  return std::exp(-largest / 2) * double(problem.landmarks.size()) >= kFalseAlarm;
}

}  // namespace

Answer solve(const Problem& problem) {
  if (!problem.is_enough()) return nothing(FixVerdict::kTooFew);
  Minima minima;
  Starts starts;
  bool is_settled = false;
  bool is_searched = true;
  if (problem.places.both >= 2) {
    const Alignment alignment = align(problem);
    const Minimum m = minimise(problem, alignment.state);
    minima.add(m);
    // All poses that could be given beside this one are within acos(0.99) = 8 degrees of it: one valley.
    is_settled = m.converged && alignment.strength > 50 * (m.cost + kRival);
  }
  if (!is_settled) {
    add_starts(problem, starts);
    for (const State& s : starts.states) {
      const double limit = limit_of(problem, minima);
      const Minimum m = minimise(problem, s, kWorth * limit);
      minima.add(m);
      if (starts.is_one_valley && m.converged && m.cost < limit) break;
    }
    if (problem.has_heading && problem.places.ranged >= 1) is_searched = add_searched(problem, minima);
  }
  Answer a = weigh(problem, minima);
  // An answer is withheld if others are possible. A weak answer states this itself and is kept.
  if (!is_searched && a.verdict != FixVerdict::kWeak) a.verdict = FixVerdict::kTooFew;
  if (a.verdict != FixVerdict::kTooFew && a.verdict != FixVerdict::kContradictory) {
    a.is_consistent = is_consistent(problem, a);
  }
  return a;
}

}  // namespace twocone::localisation::least_squares

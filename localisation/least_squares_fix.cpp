// SPDX-License-Identifier: Apache-2.0
#include "localisation/least_squares_fix.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include <Eigen/LU>

#include "localisation/chi_squared.h"
#include "localisation/least_squares/answer.h"
#include "localisation/least_squares/problem.h"

namespace twocone::localisation {
namespace {

using least_squares::Answer;
using least_squares::Frame;
using least_squares::Landmark;
using least_squares::Place;
using least_squares::Problem;

/// Fewer tell too little of their own scatter.
constexpr int kLeastWidening = 3;
/// Chi-squared is thought usual as long as it is exceeded so often.
constexpr double kUsual = 0.05;
/// Sigmas may be too small by three times, all of them alike, before that is called a contradiction.
constexpr double kMostRatio = 9;

Eigen::Vector2d to_world(const Frame& frame, const Place& place) {
  return frame.origin_m + Eigen::Vector2d(place.state.x, place.state.y) * frame.unit_m;
}

Eigen::Matrix3d to_world_covariance(const Frame& frame, const Place& place) {
  const Eigen::Vector3d unit(frame.unit_m, frame.unit_m, 1);
  return unit.asDiagonal() * place.covariance * unit.asDiagonal();
}

void fill(Fix& fix, const Problem& problem, const Answer& answer, const Frame& frame) {
  fix.verdict = answer.verdict;
  fix.chi_squared = answer.chi_squared;
  fix.degrees_of_freedom = answer.degrees_of_freedom;
  if (answer.verdict == FixVerdict::kTooFew || answer.verdict == FixVerdict::kContradictory) return;
  const Eigen::Vector2d position_m = to_world(frame, answer.place);
  const Eigen::Matrix3d covariance = to_world_covariance(frame, answer.place);
  if (!position_m.allFinite() || !covariance.allFinite()) {
    fix.verdict = FixVerdict::kTooFew;  // too large for a double
    return;
  }
  fix.used = int(problem.landmarks.size());
  fix.position_m = position_m;
  fix.covariance = covariance;
  if (problem.has_heading) fix.heading_rad = answer.place.state.heading_rad;
  if (answer.other) {
    fix.other_position_m = to_world(frame, *answer.other);
    fix.other_covariance = to_world_covariance(frame, *answer.other);
    if (problem.has_heading) fix.other_heading_rad = answer.other->state.heading_rad;
  }
  if (answer.unseen) {
    Eigen::Vector3d direction = *answer.unseen;
    // Metres beside radians; by whichever factor does not overflow.
    if (frame.unit_m > 1) {
      direction.z() /= frame.unit_m;
    } else {
      direction.head<2>() *= frame.unit_m;
    }
    fix.unseen_direction = direction.normalized();
  }
}

/// Where the residuals are larger than the stated sigmas make them, sigmas that are all too small are the likelier
/// reason than chance: the covariance is widened by chi-squared over its degrees of freedom (Birge's ratio).
void widen(Fix& fix) {
  if (fix.degrees_of_freedom < kLeastWidening || !fix.covariance) return;
  if (chi_squared_tail(fix.chi_squared, fix.degrees_of_freedom) > kUsual) return;
  fix.widening = fix.chi_squared / fix.degrees_of_freedom;
  *fix.covariance *= fix.widening;
  if (fix.other_covariance) *fix.other_covariance *= fix.widening;
}

/// All measurements together, each a little worse than it says: told with the covariance that they really have.
bool is_mild(const Answer& all) {
  return all.verdict == FixVerdict::kOk && all.degrees_of_freedom >= kLeastWidening &&
         all.chi_squared <= kMostRatio * all.degrees_of_freedom;
}

/// A set of landmarks left out whose others agree.
struct Explanation {
  std::array<int, 2> left_out;  // places in Problem::landmarks; the second is -1 for one
  Answer answer;
  bool has_heading;
};

/// Whether two explanations tell one place: each lies where the other's own covariance allows. (The sum of both would
/// let a vague one agree with a sharp one that is wrong.)
bool agree(const Explanation& a, const Explanation& b) {
  if (a.answer.verdict != FixVerdict::kOk || b.answer.verdict != FixVerdict::kOk) return false;
  const int n = a.has_heading && b.has_heading ? 3 : 2;
  const Eigen::Vector3d apart = least_squares::step_between(a.answer.place.state, b.answer.place.state);
  for (const Explanation* one : {&a, &b}) {
    const Eigen::Matrix3d& c = one->answer.place.covariance;
    const double distance2 = n == 3 ? apart.dot(c.inverse() * apart)
                                    : apart.head<2>().dot(c.topLeftCorner<2, 2>().inverse() * apart.head<2>());
    if (chi_squared_tail(distance2, n) < least_squares::kFalseAlarm) return false;
  }
  return true;
}

class OutlierSearch {
 public:
  OutlierSearch(const Problem& problem, const Answer& all) : problem_(problem), suspects_(problem.landmarks.size()) {
    std::iota(suspects_.begin(), suspects_.end(), 0);
    if (suspects_.size() <= kMostSuspects) return;
    std::vector<double> statistics(suspects_.size(), 0);
    if (all.verdict != FixVerdict::kContradictory) leave_one_out(problem, all.minimum, statistics.data());
    std::stable_sort(suspects_.begin(), suspects_.end(),
                     [&](int a, int b) { return statistics[std::size_t(a)] > statistics[std::size_t(b)]; });
    suspects_.resize(kMostSuspects);
  }

  /// The fix without the smallest set of outliers that explains the rest; contradictory where none does, or several do.
  void run(Fix& fix, const Frame& frame) {
    const auto n = problem_.landmarks.size();
    // Those left out are fewer than those believed: else which are the liars?
    for (std::size_t size = 1; size <= 2 && 2 * size < n; ++size) {
      for (std::size_t i = 0; i < suspects_.size(); ++i) {
        if (size == 1) {
          try_without(suspects_[i], -1);
          continue;
        }
        for (std::size_t j = 0; j < i; ++j) try_without(suspects_[i], suspects_[j]);
      }
      if (!found_.empty()) return choose(fix, frame);
    }
    fix.verdict = FixVerdict::kContradictory;
  }

 private:
  static constexpr std::size_t kMostSuspects = least_squares::kStackLandmarks;

  Problem without(int a, int b) {
    kept_.clear();
    for (int i = 0; i < int(problem_.landmarks.size()); ++i) {
      if (i != a && i != b) kept_.push_back(problem_.landmarks[std::size_t(i)]);
    }
    return least_squares::make_problem(kept_, problem_.rounding);
  }

  void try_without(int a, int b) {
    const Problem rest = without(a, b);
    if (rest.numbers <= rest.unknowns()) return;  // nothing over to tell whether they agree
    const Answer answer = least_squares::solve(rest);
    if (answer.is_consistent) found_.push_back({{a, b}, answer, rest.has_heading});
  }

  void choose(Fix& fix, const Frame& frame) {
    const auto best = std::min_element(found_.begin(), found_.end(), [](const Explanation& a, const Explanation& b) {
      return a.answer.chi_squared < b.answer.chi_squared;
    });
    for (auto it = found_.begin(); it != found_.end(); ++it) {
      if (it != best && !agree(*it, *best)) {
        fix.verdict = FixVerdict::kContradictory;
        return;
      }
    }
    fill(fix, without(best->left_out[0], best->left_out[1]), best->answer, frame);
    for (const int i : best->left_out) {
      if (i >= 0) fix.outliers.push_back(problem_.landmarks[std::size_t(i)].index);
    }
    std::sort(fix.outliers.begin(), fix.outliers.end());
  }

  const Problem& problem_;
  std::vector<int> suspects_;
  std::vector<Landmark> kept_;
  std::vector<Explanation> found_;
};

Fix fix_with(std::span<const LandmarkMeasurement> measurements, Landmark* room) {
  Fix fix;
  Frame frame;
  double rounding = 0;
  const int count = least_squares::prepare(measurements, frame, rounding, room);
  fix.unusable = int(measurements.size()) - count;
  const Problem problem = least_squares::make_problem({room, std::size_t(count)}, rounding);
  const Answer answer = least_squares::solve(problem);
  if (answer.is_consistent || answer.verdict == FixVerdict::kTooFew) {
    fill(fix, problem, answer, frame);
  } else {
    fix.chi_squared = answer.chi_squared;
    fix.degrees_of_freedom = answer.degrees_of_freedom;
    OutlierSearch(problem, answer).run(fix, frame);
    if (fix.verdict == FixVerdict::kContradictory && is_mild(answer)) fill(fix, problem, answer, frame);
  }
  widen(fix);
  if (fix.verdict == FixVerdict::kWeak) {
    for (std::size_t i = 0; i < measurements.size(); ++i) {
      if (!std::binary_search(fix.outliers.begin(), fix.outliers.end(), int(i))) {
        fix.measurements.push_back(measurements[i]);
      }
    }
  }
  return fix;
}

}  // namespace

Fix fix_by_least_squares(std::span<const LandmarkMeasurement> measurements) {
  if (measurements.size() <= std::size_t(least_squares::kStackLandmarks)) {
    std::array<Landmark, least_squares::kStackLandmarks> room;
    return fix_with(measurements, room.data());
  }
  std::vector<Landmark> room(measurements.size());
  return fix_with(measurements, room.data());
}

}  // namespace twocone::localisation

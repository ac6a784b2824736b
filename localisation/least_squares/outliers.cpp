// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/LU>

#include "localisation/chi_squared.h"
#include "localisation/least_squares/answer.h"
#include "localisation/least_squares/starts.h"

namespace twocone::localisation::least_squares {
namespace {

/// Returns whether two explanations give the same place: each place agrees with the other's own covariance. (With the
/// sum of both covariances, a vague explanation would agree with a sharp one that is wrong.)
bool agree(const Answer& a, const Answer& b) {
  if (a.verdict != FixVerdict::kOk || b.verdict != FixVerdict::kOk) return false;
  const bool has_heading = a.place.covariance(2, 2) > 0 && b.place.covariance(2, 2) > 0;
  const int n = has_heading ? 3 : 2;
  const Eigen::Vector3d apart = step_between(a.place.state, b.place.state);
  for (const Answer* one : {&a, &b}) {
    const Eigen::Matrix3d& c = one->place.covariance;
    const double distance2 = n == 3 ? apart.dot(c.inverse() * apart)
                                    : apart.head<2>().dot(c.topLeftCorner<2, 2>().inverse() * apart.head<2>());
    if (chi_squared_tail(distance2, n) < kFalseAlarm) return false;
  }
  return true;
}

/// Returns the best of the explanations that leave out equally many; nothing where another one gives another place.
std::optional<Cleaned> choose(const std::vector<Cleaned>& found) {
  const auto best = std::ranges::min_element(found, {}, [](const Cleaned& c) { return c.answer.chi_squared; });
  for (const Cleaned& c : found) {
    if (&c != &*best && !agree(c.answer, best->answer)) return std::nullopt;
  }
  return *best;
}

/// A problem with a subset of the landmarks.
class Subset {
 public:
  explicit Subset(const Problem& problem) : problem_(problem) {}

  /// Keeps the landmarks that are not marked.
  Problem without(const std::vector<char>& is_out) {
    kept_.clear();
    for (std::size_t i = 0; i < is_out.size(); ++i) {
      if (!is_out[i]) kept_.push_back(problem_.landmarks[i]);
    }
    return make_problem(kept_, problem_.rounding, problem_.shared);
  }
  /// Adds an explanation to `found` if the others agree.
  void try_without(const std::vector<char>& is_out, std::vector<Cleaned>& found) {
    const Problem rest = without(is_out);
    const int left_out = int(problem_.landmarks.size() - kept_.size());
    if (2 * left_out >= int(problem_.landmarks.size()) || int(kept_.size()) < kFewestBelieved) return;
    if (rest.numbers <= rest.unknowns()) return;  // without redundancy nothing shows whether they agree
    const Answer answer = solve(rest);
    if (!answer.is_consistent) return;
    Cleaned cleaned{{}, answer};
    for (int i = 0; i < int(is_out.size()); ++i) {
      if (is_out[std::size_t(i)]) cleaned.left_out.push_back(i);
    }
    found.push_back(cleaned);
  }

 private:
  const Problem& problem_;
  std::vector<Landmark> kept_;
};

class Consensus {
 public:
  explicit Consensus(const Problem& problem)
      : problem_(problem),
        count_(problem.landmarks.size()),
        limit_(2 * std::log(double(count_) / kFalseAlarm)),
        subset_(problem),
        statistics_(count_) {
    for (const Landmark& l : problem.landmarks) all_have_both_ = all_have_both_ && l.has_range && l.has_bearing;
  }

  std::optional<Cleaned> run() {
    draw();
    std::stable_sort(places_.begin(), places_.end(), [](const Place& a, const Place& b) { return a.loss < b.loss; });
    std::vector<Cleaned> found;
    std::vector<std::vector<char>> seen;
    for (std::size_t k = 0; k < std::min(places_.size(), kRefined); ++k) {
      const std::vector<char> is_out = settle(places_[k].state);
      if (is_out.empty() || std::find(seen.begin(), seen.end(), is_out) != seen.end()) continue;
      seen.push_back(is_out);
      subset_.try_without(is_out, found);
    }
    if (found.empty()) return std::nullopt;
    std::size_t fewest = count_;
    for (const Cleaned& c : found) fewest = std::min(fewest, c.left_out.size());
    std::erase_if(found, [&](const Cleaned& c) { return c.left_out.size() > fewest; });
    return choose(found);
  }

 private:
  struct Place {
    State state;
    double loss;
  };
  static constexpr int kMostSamples = 200;
  static constexpr int kFewestSamples = 12;
  static constexpr double kMissed = 1e-9;
  static constexpr std::size_t kWeighed = 128;  ///< number of landmarks by which a sample is rated, evenly spaced
  static constexpr std::size_t kRefined = 6;

  void draw() {
    const int size = all_have_both_ ? 2 : 3;
    double largest_share = 0;
    for (int k = 0; k < kMostSamples; ++k) {
      std::array<Landmark, 3> sample;
      if (!take_sample(k, size, sample)) continue;
      // The most accurate landmarks come first, as in the whole problem: then QR keeps each row's own digits.
      const Problem problem = make_problem({sample.data(), std::size_t(size)}, problem_.rounding, problem_.shared);
      if (size == 2) {
        if (problem.places.both < 2) continue;
        largest_share = std::max(largest_share, add(align(problem).state));
      } else {
        const Answer answer = solve(problem);
        if (answer.verdict == FixVerdict::kTooFew || answer.verdict == FixVerdict::kContradictory) continue;
        largest_share = std::max(largest_share, add(answer.place.state));
        if (answer.other) largest_share = std::max(largest_share, add(answer.other->state));
      }
      if (k + 1 < kFewestSamples) continue;
      // Stop where it is improbable that all samples so far held an outlier, if the largest share that agrees is true.
      if ((k + 1) * std::log1p(-std::min(1 - 1e-9, std::pow(largest_share, size))) < std::log(kMissed)) return;
    }
  }

  /// Takes landmarks k, k + a, k + b, cyclically, with steps that differ from sample to sample. Nothing is random.
  bool take_sample(int k, int size, std::array<Landmark, 3>& sample) const {
    constexpr double kGolden = 0.6180339887498949;
    std::array<std::size_t, 3> at{count_, count_, count_};  // entries that are not drawn are sorted behind the others
    for (int j = 0; j < size; ++j) {
      const double turn = (k + 1) * kGolden * (j + 1) + j * (0.37 + 0.11 * (k / double(count_)));
      at[std::size_t(j)] = std::min(count_ - 1, std::size_t((turn - std::floor(turn)) * double(count_)));
    }
    std::sort(at.begin(), at.end());
    for (int j = 1; j < size; ++j) {
      if (at[std::size_t(j)] == at[std::size_t(j - 1)]) return false;
    }
    for (int j = 0; j < size; ++j) sample[std::size_t(j)] = problem_.landmarks[at[std::size_t(j)]];
    return true;
  }

  /// @returns the share of landmarks that agree
  double add(const State& state) {
    const std::size_t stride = (count_ + kWeighed - 1) / kWeighed;
    double loss = 0;
    int agreeing = 0;
    int weighed = 0;
    for (std::size_t i = 0; i < count_; i += stride) {
      const double off = whitened_error2(problem_, problem_.landmarks[i], state);
      ++weighed;
      agreeing += off < kLoose * limit_ ? 1 : 0;
      loss += std::min(off, kLoose * limit_);
    }
    places_.push_back({state, loss});
    return double(agreeing) / weighed;
  }

  /// Marks the landmarks that do not agree with the others near a place; empty where this does not converge.
  std::vector<char> settle(State state) {
    std::vector<char> is_out(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      is_out[i] = whitened_error2(problem_, problem_.landmarks[i], state) > kLoose * limit_ ? 1 : 0;
    }
    constexpr int kMostRounds = 12;
    for (int round = 0; round < kMostRounds; ++round) {
      const Problem rest = subset_.without(is_out);
      if (!rest.is_enough() || rest.unknowns() != problem_.unknowns()) return {};
      const Minimum m = minimise(rest, state);
      state = m.state;
      forecast(problem_, m, is_out.data(), statistics_.data());
      bool is_same = true;
      for (std::size_t i = 0; i < count_; ++i) {
        const char out = statistics_[i] > limit_ ? 1 : 0;
        is_same = is_same && out == is_out[i];
        is_out[i] = out;
      }
      if (is_same) return is_out;
    }
    return {};
  }

  /// The error of a sample's place is larger than the landmarks' own noise, so twice as many sigmas are allowed.
  static constexpr double kLoose = 4;

  const Problem& problem_;
  std::size_t count_;
  double limit_;
  bool all_have_both_ = true;
  Subset subset_;
  std::vector<double> statistics_;
  std::vector<Place> places_;
};

}  // namespace

std::optional<Cleaned> without_outliers(const Problem& problem) {
  const std::size_t n = problem.landmarks.size();
  if (n < kFewestBelieved + 1) return std::nullopt;
  if (n <= std::size_t(kMostTriedInTurn)) {
    Subset subset(problem);
    std::vector<Cleaned> found;
    std::vector<char> is_out(n, 0);
    for (std::size_t i = 0; i < n; ++i) {
      is_out[i] = 1;
      subset.try_without(is_out, found);
      is_out[i] = 0;
    }
    if (found.empty()) {
      for (std::size_t j = 0; j < n; ++j) {
        for (std::size_t k = 0; k < j; ++k) {
          is_out[j] = is_out[k] = 1;
          subset.try_without(is_out, found);
          is_out[j] = is_out[k] = 0;
        }
      }
    }
    if (!found.empty()) return choose(found);
    if (n < 7) return std::nullopt;  // three or more are not fewer than half
  }
  return Consensus(problem).run();
}

}  // namespace twocone::localisation::least_squares

// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/both_runs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "base/quantile.h"
#include "localisation/odometry.h"

namespace twocone::compare {
namespace {

double log_choose(double n, double k) { return std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1); }

/// Returns the total probability of all whole numbers from `least` to `most` that are at most as probable as `seen`.
template <typename LogProbability>
double tail_of(double seen, double least, double most, const LogProbability& log_probability) {
  constexpr double kRounding = 1e-9;  // rounding error of logarithms of some thousands
  const double limit = log_probability(seen) + kRounding;
  double sum = 0;
  for (double k = least; k <= most; ++k) {  // NOLINT(clang-analyzer-security.FloatLoopCounter): whole numbers
    const double here = log_probability(k);
    if (here <= limit) sum += std::exp(here);
  }
  return std::min(1.0, sum);
}

}  // namespace

std::string why_other_rooms(const config::Map& a, const config::Map& b) {
  // This is far above the error of a survey, and below the differences between rooms of some metres.
  constexpr double kOtherRoom_m = 0.5;
  std::vector<std::pair<const config::Landmark*, const config::Landmark*>> both;
  for (const config::Landmark& of_a : a.landmarks) {
    for (const config::Landmark& of_b : b.landmarks) {
      if (of_a.name == of_b.name) both.emplace_back(&of_a, &of_b);
    }
  }
  if (both.size() < 2) {
    if (a.landmarks.size() < 2 && b.landmarks.size() < 2) return "";
    return fmt::format("their maps have {} of the same name", both.empty() ? "no landmark" : "one landmark");
  }
  std::vector<double> differences_m;
  for (std::size_t i = 0; i < both.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const auto apart_m = [](const config::Landmark& p, const config::Landmark& q) {
        return std::hypot(p.x_m - q.x_m, p.y_m - q.y_m);
      };
      differences_m.push_back(
          std::abs(apart_m(*both[i].first, *both[k].first) - apart_m(*both[i].second, *both[k].second)));
    }
  }
  // A moved landmark changes only its own pairs. These are at most two thirds of all, if there are three landmarks or
  // more, so the lower quartile is not affected.
  const auto quartile = differences_m.begin() + std::ptrdiff_t(differences_m.size() / 4);
  std::nth_element(differences_m.begin(), quartile, differences_m.end());
  if (*quartile <= kOtherRoom_m) return "";
  return fmt::format("the distances between landmarks of the same name differ by {:.1f} m and more in most cases",
                     *quartile);
}

std::vector<Match> match_by_time(std::span<const double> simulated, std::span<const double> real, double most_apart_s) {
  std::vector<Match> matches;
  if (simulated.empty()) return matches;
  for (std::size_t i = 0; i < real.size(); ++i) {
    auto nearest = std::lower_bound(simulated.begin(), simulated.end(), real[i]);
    if (nearest == simulated.end() ||
        (nearest != simulated.begin() && real[i] - *std::prev(nearest) < *nearest - real[i])) {
      --nearest;
    }
    if (std::abs(*nearest - real[i]) <= most_apart_s) matches.push_back({std::size_t(nearest - simulated.begin()), i});
  }
  return matches;
}

double distance_m(const runlog::PoseRow& a, const runlog::PoseRow& b) {
  constexpr double kMetresPerRadian = 1;
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m,
                    kMetresPerRadian * localisation::wrap_angle_rad(a.heading_rad - b.heading_rad));
}

std::vector<Match> match_by_pose(std::span<const std::optional<runlog::PoseRow>> simulated,
                                 std::span<const std::optional<runlog::PoseRow>> real, double most_apart_m) {
  // The poses are sorted by x first, because a comparison of all pairs of frames takes too long for runs of hours.
  std::vector<std::size_t> by_x;
  for (std::size_t k = 0; k < simulated.size(); ++k) {
    if (simulated[k]) by_x.push_back(k);
  }
  const auto x_of = [&](std::size_t k) { return simulated[k]->x_m; };
  std::ranges::stable_sort(by_x, {}, x_of);
  std::vector<Match> matches;
  for (std::size_t i = 0; i < real.size(); ++i) {
    if (!real[i]) continue;
    const auto first = std::ranges::lower_bound(by_x, real[i]->x_m - most_apart_m, {}, x_of);
    double least_m = most_apart_m;
    std::optional<std::size_t> best;
    for (auto at = first; at != by_x.end() && x_of(*at) <= real[i]->x_m + most_apart_m; ++at) {
      const double apart_m = distance_m(*simulated[*at], *real[i]);
      if (apart_m > least_m || (best && apart_m == least_m)) continue;
      least_m = apart_m;
      best = *at;
    }
    if (best) matches.push_back({*best, i});
  }
  return matches;
}

std::optional<runlog::PoseRow> pose_at(std::span<const runlog::PoseRow> poses, double t_s, double longest_gap_s) {
  const auto after = std::ranges::lower_bound(poses, t_s, {}, &runlog::PoseRow::t_s);
  if (after == poses.end()) return std::nullopt;
  if (after->t_s == t_s) return *after;
  if (after == poses.begin()) return std::nullopt;
  const runlog::PoseRow& before = *std::prev(after);
  if (after->t_s - before.t_s > longest_gap_s) return std::nullopt;
  const double share = (t_s - before.t_s) / (after->t_s - before.t_s);
  return runlog::PoseRow{
      t_s, before.x_m + share * (after->x_m - before.x_m), before.y_m + share * (after->y_m - before.y_m),
      localisation::wrap_angle_rad(before.heading_rad +
                                   share * localisation::wrap_angle_rad(after->heading_rad - before.heading_rad))};
}

Timing timing_of(const runlog::RunData& run) {
  Timing timing;
  std::vector<double> steps_s;
  double skew = 0, squares = 0;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const runlog::FrameRow& frame = run.frames[i];
    skew += frame.upper_t_s - frame.lower_t_s;
    squares += std::pow(frame.upper_t_s - frame.lower_t_s, 2);
    timing.most_skew_s = std::max(timing.most_skew_s, std::abs(frame.skew_s));
    timing.lost[0] += frame.lower_lost;
    timing.lost[1] += frame.upper_lost;
    if (i == 0) continue;
    const runlog::FrameRow& last = run.frames[i - 1];
    if (frame.lower_sequence == last.lower_sequence + 1 && frame.upper_sequence == last.upper_sequence + 1) {
      steps_s.push_back(frame.t_s - last.t_s);
    }
  }
  const auto count = double(run.frames.size());
  for (const std::size_t k : {0, 1}) timing.all[k] = run.frames.size() + timing.lost[k];
  timing.skew_s = skew / count;
  timing.skew_sigma_s = std::sqrt(std::max(0.0, squares / count - timing.skew_s * timing.skew_s) / count);
  if (!steps_s.empty()) {
    const double usual_s = base::quantile(steps_s, 0.5);
    if (usual_s > 0) timing.rate_hz = 1 / usual_s;
    double sum = 0;
    for (const double step_s : steps_s) sum += (step_s - usual_s) * (step_s - usual_s);
    timing.jitter_s = std::sqrt(sum / double(steps_s.size()));
  }
  if (!config::is_simulated(run.robot) && run.frames.size() > 1) {
    const runlog::FrameRow& first = run.frames.front();
    const runlog::FrameRow& last = run.frames.back();
    if (first.host_t_s && last.host_t_s) timing.ageing_s = (*last.host_t_s - last.t_s) - (*first.host_t_s - first.t_s);
  }
  return timing;
}

double lost_p_value(std::uint64_t lost, std::uint64_t all, double probability) {
  if (probability <= 0) return lost == 0 ? 1 : 0;
  if (probability >= 1) return lost == all ? 1 : 0;
  return tail_of(double(lost), 0, double(all), [&](double k) {
    return log_choose(double(all), k) + k * std::log(probability) + (double(all) - k) * std::log1p(-probability);
  });
}

double lost_p_value(std::uint64_t lost_a, std::uint64_t all_a, std::uint64_t lost_b, std::uint64_t all_b) {
  const auto lost = double(lost_a + lost_b);
  const auto all = double(all_a + all_b);
  return tail_of(double(lost_a), std::max(0.0, lost - double(all_b)), std::min(lost, double(all_a)), [&](double of_a) {
    return log_choose(double(all_a), of_a) + log_choose(double(all_b), lost - of_a) - log_choose(all, lost);
  });
}

}  // namespace twocone::compare

// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/matching.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "localisation/odometry.h"

namespace twocone::compare {

std::string why_other_rooms(const config::Map& a, const config::Map& b) {
  // Far more than the error of a survey, and less than the difference between rooms of some metres.
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
  // A landmark that was moved changes its own pairs, at most two thirds of all, so the lower quartile is not affected.
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
  // Sorted by position first, because comparing all pairs of frames of hour-long runs would take too long.
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

}  // namespace twocone::compare

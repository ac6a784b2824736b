// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/matching.h"

#include <algorithm>
#include <cmath>

#include "localisation/odometry.h"

namespace twocone::compare {

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

double distance_m(const runs::PoseRow& a, const runs::PoseRow& b) {
  constexpr double kMetresPerRadian = 1;
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m,
                    kMetresPerRadian * localisation::wrap_angle_rad(a.heading_rad - b.heading_rad));
}

std::vector<Match> match_by_pose(std::span<const std::optional<runs::PoseRow>> simulated,
                                 std::span<const std::optional<runs::PoseRow>> real, double most_apart_m) {
  // By place first: runs of an hour would else take squares of their frames.
  std::vector<std::size_t> by_x;
  for (std::size_t k = 0; k < simulated.size(); ++k) {
    if (simulated[k]) by_x.push_back(k);
  }
  const auto x_of = [&](std::size_t k) { return simulated[k]->x_m; };
  std::stable_sort(by_x.begin(), by_x.end(), [&](std::size_t a, std::size_t b) { return x_of(a) < x_of(b); });
  std::vector<Match> matches;
  for (std::size_t i = 0; i < real.size(); ++i) {
    if (!real[i]) continue;
    const auto first = std::lower_bound(by_x.begin(), by_x.end(), real[i]->x_m - most_apart_m,
                                        [&](std::size_t k, double x_m) { return x_of(k) < x_m; });
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

std::optional<runs::PoseRow> pose_at(std::span<const runs::PoseRow> poses, double t_s, double longest_gap_s) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), t_s,
                                      [](const runs::PoseRow& pose, double time_s) { return pose.t_s < time_s; });
  if (after == poses.end()) return std::nullopt;
  if (after->t_s == t_s) return *after;
  if (after == poses.begin()) return std::nullopt;
  const runs::PoseRow& before = *std::prev(after);
  if (after->t_s - before.t_s > longest_gap_s) return std::nullopt;
  const double share = (t_s - before.t_s) / (after->t_s - before.t_s);
  return runs::PoseRow{
      t_s, before.x_m + share * (after->x_m - before.x_m), before.y_m + share * (after->y_m - before.y_m),
      localisation::wrap_angle_rad(before.heading_rad +
                                   share * localisation::wrap_angle_rad(after->heading_rad - before.heading_rad))};
}

}  // namespace twocone::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/tradeoff/setting.h"
#include "apps/tradeoff/statistics.h"

namespace twocone::tradeoff {

/// The level of every confidence interval that a sweep reports.
inline constexpr double kConfidence = 0.95;

/// Absolute errors of a setting, with 95 % confidence intervals over episodes (statistics.h).
struct ErrorFigures {
  Interval mean, rmse, p95;
  double max = 0;
};

/// Times of one frame.
struct TimeFigures {
  Interval median_s;
  double spread_s = 0;  ///< from the first to the third quartile
  Interval p95_s;
};

/// Accuracy and costs of a setting.
struct SettingResult {
  Setting setting;
  int frames = 0;                                                ///< frames that require an answer
  int answered = 0;                                              ///< those of them with exactly one position
  std::optional<ErrorFigures> position_m, heading_rad, range_m;  ///< none without answers
  /// Share of answers whose own 95 % ellipse contains the truth (Wilson's interval); none where no answer states a
  /// covariance.
  std::optional<Interval> coverage;
  /// Root mean square of the Cramer-Rao bound of the position, from these images with all of the map's landmarks; for
  /// several frames, with wheels that measure their motion exactly. None where no outline of a landmark was ever
  /// measured.
  std::optional<double> bound_m;
  TimeFigures render_cpu, vision, localisation;  ///< processor time; rendering: both images, time of POV-Ray
  TimeFigures robot;                             ///< vision and localisation of one frame together
  double peak_bytes = 0;                         ///< of the program, with one pair of images
  double render_bytes = 0;                       ///< of the largest POV-Ray process
  bool on_robot_frontier = false;
  bool on_simulation_frontier = false;

  [[nodiscard]] double answered_share() const { return frames > 0 ? double(answered) / frames : 0; }
  /// Returns the time that `--budget-ms` limits: the 95 % quantile of vision and localisation of a frame on one core.
  [[nodiscard]] const Interval& robot_time_s() const { return robot.p95_s; }
  /// Returns that time plus the median processor time of rendering.
  [[nodiscard]] Interval simulation_time_s() const {
    return {robot.p95_s.value + render_cpu.median_s.value, robot.p95_s.low + render_cpu.median_s.low,
            robot.p95_s.high + render_cpu.median_s.high};
  }
};

/// A setting that answers less often than this is on no frontier and is not chosen.
constexpr double kLeastAnswered = 0.9;
/// Returns whether a setting answers often enough and has an error.
inline bool answers_enough(const SettingResult& result) {
  return result.position_m && result.answered_share() >= kLeastAnswered;
}

/// A finished sweep.
struct Sweep {
  std::string robot, map;                 ///< files, as the command named them
  std::string version, commit, compiler;  ///< of the program
  std::string machine;                    ///< processor and number of cores
  std::string repeat;                     ///< the command that gives the same errors again
  std::uint64_t seed = 0;
  int episodes = 0;                     ///< independent poses
  std::vector<std::string> landmarks;   ///< Plan::landmarks
  std::vector<SettingResult> settings;  ///< in the plan's order
  /// Index in `settings` of the robot file's own, unchanged setting. None if that was not swept.
  std::optional<std::size_t> as_is{};
};

/// The paper's own result: "to within 30 mm" at about 2 s for a stereo frame (Burbridge & Spacek 2006, sections 4 and
/// 5).
constexpr double kPaperMeanError_m = 0.02997, kPaperTime_s = 2;

/// A point of the plane; smaller is better in both.
struct CostAndError {
  double cost = 0, error = 0;
};
/// Returns the indices of the points that no other point dominates (as good in both numbers and better in one), by
/// rising cost. Points that are not finite are on no frontier; of equal points the first one is.
std::vector<std::size_t> pareto_frontier(std::span<const CostAndError> points);

/// Sets SettingResult::on_robot_frontier and on_simulation_frontier. They use the mean position error against
/// robot_time_s() and simulation_time_s(), over the settings that answer often enough (kLeastAnswered); the robot's
/// frontier uses Effects::kScene only.
void mark_frontiers(std::vector<SettingResult>& settings);

}  // namespace twocone::tradeoff

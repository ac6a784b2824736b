// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/estimation/method.h"
#include "apps/tradeoff/statistics.h"

namespace twocone::tradeoff {

/// Effects of the simulated world.
enum class Effects {
  kScene,  ///< the effects of scene, map and robot file
  kFlat,   ///< the same without shadows, area lights, photons, radiosity and media
  kNoise,  ///< as kScene; if the robot file sets no sensor noise, with that of kNoiseElectrons
};

/// Full well of Effects::kNoise: noise of about two grey levels of 255 in the brightest pixel.
constexpr double kNoiseElectrons = 5000;

/// The estimator that computes an answer from images.
enum class Level {
  kPaper,     ///< method paper
  kFound,     ///< method outline, landmarks located to a pixel or two (vision::Stage::kFound)
  kCoarse,    ///< method outline, outlines fitted coarsely (kCoarse)
  kFine,      ///< method outline, fitted with all information of the pixels (kFine): the default of `run`
  kAdaptive,  ///< method outline, refined as far as the stated sigma requires, down to Setting::enough_m
};

/// One set of images. All sets of a sweep are taken at the same poses; a set with fewer episodes uses the first ones.
struct Images {
  int width_px = 0, height_px = 0;
  int antialias = 1;  ///< rays per pixel side
  Effects effects = Effects::kScene;

  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 misreads it
  friend auto operator<=>(const Images&, const Images&) = default;
};

/// One configuration of a robot's vision and localisation.
struct Setting {
  Images images{};
  Level level = Level::kFine;
  double enough_m = 0;   ///< for kAdaptive: config::EstimatorKeys::enough_m; else 0
  int landmarks = 0;     ///< number of landmarks searched for, >= 3: the first ones of Plan::landmarks
  bool bearings = true;  ///< false: fixes from ranges only
  double rate_hz = 0;    ///< rate of the frames that are used
  int frames = 1;        ///< 1: fixes of single frames; more: the filter's estimate after this number of frames

  /// Returns whether fixes use bearings; those of method paper never do.
  [[nodiscard]] bool uses_bearings() const { return bearings && level != Level::kPaper; }

  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 misreads it
  friend auto operator<=>(const Setting&, const Setting&) = default;
};

/// The properties in which settings differ, one at a time.
enum class Axis { kSize, kAntialias, kEffects, kLevel, kLandmarks, kBearings, kRate, kFrames };
inline constexpr std::array kAllAxes{Axis::kSize,      Axis::kAntialias, Axis::kEffects, Axis::kLevel,
                                     Axis::kLandmarks, Axis::kBearings,  Axis::kRate,    Axis::kFrames};
/// The place of a setting on an axis, by which settings are ordered (levels: by Level, then by enough_m). On an axis
/// with a size, the first number is the size (pixels of an image, landmarks, frames, ...).
using AxisPlace = std::pair<double, double>;
struct AxisFacts {
  std::string_view name;   ///< as in tables and files: size, antialias, effects, estimator, ...
  std::string_view title;  ///< name of the axis in a sentence
  bool costs_rendering;    ///< true: its cost is the simulation time; false: the robot time
  bool is_sized;           ///< whether a larger value can be called "beyond" a smaller one
  /// Returns the setting's value on the axis, in words: "640x480", "+R2" ("none" for 1), "scene", "outline, fine", "6",
  /// "ranges and bearings", "15 Hz", "4".
  std::string (*value)(const Setting& setting);
  AxisPlace (*place)(const Setting& setting);
};
const AxisFacts& facts_of(Axis axis);
/// Returns scene, flat or noise.
std::string_view name(Effects effects);
/// Returns paper, found, coarse, fine or adaptive.
std::string_view name(Level level);
/// Returns all values in one line: "640x480, anti-aliasing +R2, scene, outline, fine, 6 landmarks, ranges and bearings,
/// 15 Hz, 4 frames"; "single frames" for one frame.
std::string describe(const Setting& setting);

/// Returns the robot with the setting's values: image size, anti-aliasing, rate, noise and `estimator:`. Values in
/// pixels are scaled with the images: a coordinate c becomes (c + 0.5) k - 0.5. @param landmarks Plan::landmarks
config::Robot robot_of(const Setting& setting, const config::Robot& robot, std::span<const std::string> landmarks);
/// Returns the map with the setting's effects: Effects::kFlat switches off the map's own.
config::Map map_of(const Setting& setting, const config::Map& map);
/// Returns the method of a level.
estimation::Method method_of(Level level);

// ---- results

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
  int answered = 0;                                              ///< number of them with exactly one position
  std::optional<ErrorFigures> position_m, heading_rad, range_m;  ///< empty without answers
  /// Share of answers whose own 95 % ellipse contains the truth (Wilson's interval); empty if no answer states a
  /// covariance.
  std::optional<Interval> coverage;
  /// Root mean square of the Cramer-Rao bound of the position, from these images with all of the map's landmarks. For
  /// several frames, it assumes that the wheels measure the motion exactly. Empty if no outline was ever measured.
  std::optional<double> bound_m;
  TimeFigures render_cpu, vision, localisation;  ///< processor time; rendering: both images, time of POV-Ray
  TimeFigures robot;                             ///< vision and localisation of one frame together
  double peak_bytes = 0;                         ///< peak memory of the program, with one pair of images
  double render_bytes = 0;                       ///< peak memory of the largest POV-Ray process
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

/// A setting with a smaller share of answered frames is on no frontier and is not chosen.
constexpr double kLeastAnswered = 0.9;
/// Returns whether a setting answers often enough and its position error is known.
inline bool answers_enough(const SettingResult& result) {
  return result.position_m && result.answered_share() >= kLeastAnswered;
}

/// A finished sweep.
struct Sweep {
  std::string robot, map;                 ///< files, as the command named them
  std::string version, commit, compiler;  ///< of the program
  std::string machine;                    ///< processor and number of cores
  std::string repeat;                     ///< the command that reproduces the errors
  std::uint64_t seed = 0;
  int episodes = 0;                     ///< independent poses
  std::vector<std::string> landmarks;   ///< Plan::landmarks
  std::vector<SettingResult> settings;  ///< in the plan's order
  /// Index in `settings` of the robot file's own, unchanged setting. Empty if that was not swept.
  std::optional<std::size_t> as_is{};
};

/// The paper's result: "to within 30 mm" at about 2 s for a stereo frame (Burbridge & Spacek 2006, sections 4 and 5).
constexpr double kPaperMeanError_m = 0.02997, kPaperTime_s = 2;

/// A point in the plane of cost and error. A smaller number is better in both.
struct CostAndError {
  double cost = 0, error = 0;
};
/// Returns the indices, by rising cost, of the points that no other point dominates. A point dominates another one if
/// it is as good in both numbers and better in one. Points that are not finite are on no frontier. Of equal points,
/// only the first one is on it.
std::vector<std::size_t> pareto_frontier(std::span<const CostAndError> points);

/// Sets SettingResult::on_robot_frontier and on_simulation_frontier. They use the mean position error against
/// robot_time_s() and simulation_time_s(), over the settings that answer often enough (kLeastAnswered); the robot's
/// frontier uses Effects::kScene only.
void mark_frontiers(std::vector<SettingResult>& settings);

}  // namespace twocone::tradeoff

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <variant>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/estimation/method.h"
#include "hal/image.h"
#include "localisation/fix.h"
#include "vision/outline_ranging.h"
#include "vision/paper_ranging.h"

namespace twocone::estimation {

/// The time and work that an answer took.
struct Timing {
  double vision_s = 0;        ///< processor time of the calling thread, from two images to ranges and bearings
  double localisation_s = 0;  ///< likewise, from ranges and bearings to the fix
  double wall_s = 0;          ///< of both together, by the wall clock
  int refined = 0;            ///< landmarks refined to vision::Stage::kFine in one view or both
  /// Stage `adaptive` with a time budget: whether the answer took longer.
  bool is_over_budget = false;
};

/// The answer for one stereo frame: a measurement for each landmark in the map's order, and the fix from them.
struct FrameAnswer {
  std::vector<vision::RangeMeasurement> ranges;
  localisation::Fix fix;
  Timing timing{};
};

/// Returns the fix from ranges and bearings. landmarks_m[i] is the position of the landmark of measured[i], world
/// frame. The fix's outliers are indices of both vectors.
localisation::Fix fix_of_outline(const std::vector<vision::RangeMeasurement>& measured,
                                 const std::vector<Eigen::Vector2d>& landmarks_m, bool use_bearings);

/// Returns the processor time of the calling thread, seconds; its zero has no meaning.
double thread_time_s();

/// Returns the time of std::chrono::steady_clock in seconds; its zero has no meaning.
double steady_time_s();

/// Ranges and localises according to the robot file and the map (config::EstimatorKeys; method paper uses only its
/// `landmarks`). Live runs and stored images use the same code. Without a time budget the answer is a function of the
/// two images alone. A fix of method `outline` is checked against the map's bounds (check_bounds).
class Estimator {
 public:
  /// @param clock_s seconds; the clock of the time budget and of Timing::wall_s
  /// @throws config::FileError for a rig or a map that the method cannot use, and for an unknown stage or landmark
  Estimator(Method method, const config::Robot& robot, const config::Map& map,
            std::function<double()> clock_s = steady_time_s);

  /// Errors: kBadData if an image has a size other than that in the robot file, or too few bytes.
  [[nodiscard]] Result<FrameAnswer> answer(const Image& lower, const Image& upper) const;

 private:
  [[nodiscard]] FrameAnswer answer_by_outline(const vision::OutlineRanging& ranging, const cv::Mat& lower,
                                              const cv::Mat& upper, double begin_s) const;

  std::vector<Eigen::Vector2d> landmarks_m_;
  config::Bounds bounds_;
  cv::Size lower_size_;
  cv::Size upper_size_;
  std::array<Eigen::Vector2d, 2> centres_px_;  ///< of lower and upper
  config::EstimatorKeys keys_;
  std::optional<vision::Stage> stage_;  ///< none: adaptive
  std::function<double()> clock_s_;
  std::vector<std::size_t> wanted_;
  std::variant<vision::PaperRanging, vision::OutlineRanging> ranging_;
};

// ---- the steps of an answer

/// Number of sigmas beyond a wall above which a position counts as outside. A normal variable exceeds it once in a
/// million cases. (The body's origin is at least its radius away from any wall. This margin also allows for an error of
/// map and rig.)
constexpr double kOutsideSigmas = 4.75;

/// Checks a fix against the map's bounds. They are walls, so a robot is never outside.
///
/// A position that is outside by more than kOutsideSigmas of its sigma, along the direction to the nearest wall, makes
/// the fix `out_of_bounds`. It keeps the position and its covariance. If only one position of an `ambiguous` fix is
/// outside, that position is dropped and the fix is `ok`. If both are outside, the first is kept as `out_of_bounds`. A
/// `weak` fix is not checked, because its position may lie anywhere along the unseen direction. A fix without
/// covariance is not checked either.
void check_bounds(const config::Bounds& bounds, localisation::Fix& fix);

/// Refines one frame landmark by landmark until its position is known well enough (stage `adaptive`).
///
/// 1. It takes all landmarks as the finder measured them (vision::Stage::kFound) and computes the fix from them. If the
///    position sigma sqrt(var x + var y) is enough_m or less, this fix is the answer.
/// 2. Otherwise the fix predicts every landmark's place to a fraction of a pixel, and the whole outline is fitted from
///    there at once. This saves the coarse fits, a third of the work (vision::FrameObservation::expect).
/// 3. Landmarks are refined to kFine one by one and view by view. The next one is always the one that is predicted to
///    reduce the variance of the position most. The prediction takes the information of the found stage and multiplies
///    the sigma by kFineOverFound. So near landmarks come before far ones, landmarks that measure the weak direction
///    before others, and the view that shows a landmark larger before the other view. That other view keeps its found
///    measurement.
/// 4. Refinement ends if the fix from all landmarks, refined or not, reaches enough_m, has no outlier and uses
///    kLeastRefined or more refined landmarks, or if nothing is left to refine. Landmarks that are not refined keep
///    their found measurement. It has little weight, and it contradicts a landmark that is refined to a wrong place.
/// 5. A landmark whose outline cannot be fitted, although its colour is there, keeps its found measurement.
///
/// A time budget can end refinement earlier. A refinement starts only if it and the fix after it are predicted to end
/// within the time budget. The prediction is the mean time of the refinements in this frame so far. The first one is
/// assumed to take as long as the finder.
/// @param keys its `bearings`, `enough_m` and `budget_s`
/// @param centres_px positions of the tips in the lower and the upper image
/// @param clock_s seconds, read only with a time budget
/// @param begin_s time by that clock when the work on the frame began
/// @returns the answer; of its timing only localisation_s, which counts the fixes and the order of refinement
FrameAnswer refine_adaptively(vision::FrameObservation& observation, const std::vector<Eigen::Vector2d>& landmarks_m,
                              const std::array<Eigen::Vector2d, 2>& centres_px, const config::EstimatorKeys& keys,
                              const std::function<double()>& clock_s, double begin_s);

}  // namespace twocone::estimation

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <variant>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "apps/estimation/method.h"
#include "apps/estimation/scanner.h"
#include "base/plane.h"
#include "base/shared_errors.h"
#include "hal/image.h"
#include "localisation/fix.h"
#include "vision/beam.h"
#include "vision/outline_ranging.h"
#include "vision/paper_ranging.h"

namespace twocone::estimation {

/// The time and work that an answer took.
struct Timing {
  double vision_s = 0;        ///< processor time of the calling thread, from two images to ranges and bearings
  double localisation_s = 0;  ///< likewise, from ranges and bearings to the fix
  double wall_s = 0;          ///< time of both together, by the clock of the estimator
  int refined = 0;            ///< landmarks refined to vision::Stage::kFine in one view or both
  /// Whether an answer of stage `adaptive` took longer than its time budget.
  bool is_over_budget = false;
};

/// The answer for one stereo frame: a measurement for each landmark in the map's order, and the fix from them.
struct FrameAnswer {
  std::vector<vision::RangeMeasurement> ranges;
  localisation::Fix fix;
  std::vector<vision::Beam> scan{};  ///< with estimator.plan
  Timing timing{};
};

/// Returns the fix from ranges and bearings. landmarks_m[i] is the position of the landmark of measured[i] in the world
/// frame. The fix's outliers are indices into both vectors.
/// @param places_by_shared errors of landmarks_m[i]; empty: they are known exactly
localisation::Fix fix_of_outline(const std::vector<vision::RangeMeasurement>& measured,
                                 const std::vector<Eigen::Vector2d>& landmarks_m, bool use_bearings,
                                 const std::vector<BySharedErrors<2>>& places_by_shared = {});

/// Returns the processor time of the calling thread, seconds. Only differences have a meaning.
double thread_time_s();

/// Returns the time of std::chrono::steady_clock, seconds. Only differences have a meaning.
double steady_time_s();

/// Computes ranges and a fix from two images, according to the robot file (config::EstimatorKeys) and the map. Method
/// `paper` uses only the key `landmarks`. Live runs and stored images use the same code. Without a time budget the
/// answer depends on the two images alone. A fix of method `outline` is checked against the map's bounds
/// (check_bounds).
class Estimator {
 public:
  /// @param clock_s clock of the time budget and of Timing::wall_s, seconds
  /// @throws config::FileError for a rig or a map that the method cannot use, and for an unknown stage or landmark
  Estimator(Method method, const config::Robot& robot, const config::Map& map,
            std::function<double()> clock_s = steady_time_s);

  /// Returns the answer for one stereo frame, at the time of its lower image's stamp.
  /// @param motion of the body while the images are exposed, from the wheels; nothing: the robot stands. Method `paper`
  /// does not use it.
  /// Errors: kBadData if the size of an image differs from that in the robot file, if the number of its bytes is wrong,
  /// or if its JPEG data are damaged.
  [[nodiscard]] Result<FrameAnswer> answer(const Image& lower, const Image& upper,
                                           const std::optional<vision::FrameMotion>& motion = {}) const;

 private:
  [[nodiscard]] FrameAnswer answer_by_outline(const vision::OutlineRanging& ranging, const cv::Mat& lower,
                                              const cv::Mat& upper, const std::optional<vision::FrameMotion>& motion,
                                              double begin_s) const;

  std::vector<Eigen::Vector2d> landmarks_m_;
  config::BeliefErrors belief_errors_;
  config::Bounds bounds_;
  cv::Size lower_size_;
  cv::Size upper_size_;
  std::array<Eigen::Vector2d, 2> centres_px_;  ///< of lower and upper
  config::EstimatorKeys keys_;
  std::optional<vision::Stage> stage_;  ///< none: adaptive
  std::function<double()> clock_s_;
  std::vector<std::size_t> wanted_;
  std::variant<vision::PaperRanging, vision::OutlineRanging> ranging_;
  std::optional<Scanner> scanner_;
};

// ---- the steps of an answer

/// A position counts as outside if it is more than this number of sigmas beyond a wall. A normal variable exceeds it
/// once in a million cases. There is a further margin for errors of map and rig: the body's origin is at least the
/// body's radius away from any wall.
constexpr double kOutsideSigmas = 4.75;

/// Checks a fix against the map's bounds. They are walls, so a robot is never outside.
///
/// The distance outside is compared with kOutsideSigmas times the position's sigma along the direction to the nearest
/// wall. If it is larger, the fix becomes `out_of_bounds` and keeps the position and its covariance. If only one
/// position of an `ambiguous` fix is outside, that position is dropped and the fix becomes `ok`. If both are outside,
/// the first one is kept as `out_of_bounds`. A `weak` fix is not checked, because its position may lie anywhere along
/// the unseen direction. A fix without covariance is not checked either.
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
/// 5. A landmark whose outline cannot be fitted, although its colour is seen, keeps its found measurement.
///
/// A time budget can end refinement earlier. A refinement starts only if it and the fix after it are predicted to end
/// within the time budget. The prediction is the mean time of the refinements in this frame so far. The first one is
/// assumed to take as long as the finder.
/// @param keys only `bearings`, `enough_m` and `budget_s` are used
/// @param places_by_shared as for fix_of_outline()
/// @param centres_px positions of the tips in the lower and the upper image
/// @param clock_s seconds, read only with a time budget
/// @param begin_s time on that clock at which the work on the frame began
/// @returns the answer; its timing has only localisation_s, the time of the fixes
FrameAnswer refine_adaptively(vision::FrameObservation& observation, const std::vector<Eigen::Vector2d>& landmarks_m,
                              const std::vector<BySharedErrors<2>>& places_by_shared,
                              const std::array<Eigen::Vector2d, 2>& centres_px, const config::EstimatorKeys& keys,
                              const std::function<double()>& clock_s, double begin_s);

}  // namespace twocone::estimation

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "apps/config/robot_file.h"
#include "apps/estimation/estimator.h"
#include "localisation/fix.h"
#include "vision/outline_ranging.h"

namespace twocone::estimation {

/// Returns the fix from ranges and bearings. landmarks_m[i] is the position of the landmark of measured[i], world
/// frame. The fix's outliers are indices of both vectors.
localisation::Fix fix_of_outline(const std::vector<vision::RangeMeasurement>& measured,
                                 const std::vector<Eigen::Vector2d>& landmarks_m, bool use_bearings);

/// Returns the processor time of the calling thread, seconds; its zero has no meaning.
double thread_time_s();

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

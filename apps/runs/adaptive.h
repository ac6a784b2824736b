// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "localisation/fix.h"
#include "vision/full_ranging.h"

namespace twocone::runs {

/// Fixes from ranges and bearings: landmarks_m[i] is where measured[i] stands, world frame; outliers are indices of
/// both.
localisation::Fix fix_of_full(const std::vector<vision::RangeMeasurement>& measured,
                              const std::vector<Eigen::Vector2d>& landmarks_m, bool use_bearings);

/// Processor time of the calling thread, seconds; its zero means nothing.
double thread_time_s();

/// Refines one frame landmark by landmark until its position is known well enough (stage `adaptive`).
///
/// 1. All landmarks as the finder has them (vision::Stage::kFound), and the fix from them. Where it states a position
///    sigma sqrt(var x + var y) of enough_m or less, that is the answer.
/// 2. Else that fix tells every landmark's place to a part of a pixel, from where its whole outline is fitted at once:
///    the coarse fits, a third of the work, are saved (vision::Looking::expect).
/// 3. Landmarks are taken to kFine one by one, view by view, each time the one by which the position's variance is
///    predicted to fall most: by the information of the found stage, kFineOverFound times as sharp. So near ones come
///    before far ones, those that see the weak direction before others, and the view that shows it larger before the
///    other, which stays in as it was found.
/// 4. It ends when the fix from all, refined or not, states enough_m, names no outlier and rests on kLeastRefined or
///    more refined ones, or when nothing is left to refine. Those that are not refined stay in as they were found: they
///    weigh little, and contradict one that is refined to a wrong place.
/// 5. A landmark whose outline cannot be fitted, though its colour is there, stays as it was found.
///
/// A budget ends it earlier: no refinement is begun that would end, with the fix from it, after the budget; by the mean
/// time of those in this frame so far, the first taken to last as long as the finder did.
class Adaptive {
 public:
  struct Settings {
    bool use_bearings = true;
    double enough_m = 0.001;
    std::optional<double> budget_s;
  };
  /// @param centres_px where the tips are in the lower and the upper picture
  /// @param clock_s seconds, read only with a budget @param begin_s when the frame's work began, by it
  Adaptive(const std::vector<Eigen::Vector2d>& landmarks_m, const std::array<Eigen::Vector2d, 2>& centres_px,
           const Settings& settings, const std::function<double()>& clock_s, double begin_s)
      : landmarks_m_(landmarks_m), centres_px_(centres_px), settings_(settings), clock_s_(clock_s), begin_s_(begin_s) {}

  struct Answer {
    std::vector<vision::RangeMeasurement> ranges;
    localisation::Fix fix;
    double localisation_s = 0;  ///< processor time that went into fixes and the order
  };
  [[nodiscard]] Answer run(vision::Looking& looking) const;

 private:
  class Information;
  [[nodiscard]] bool is_enough(const localisation::Fix& fix) const;
  /// By the clock, when the finder and the first fix were done.
  struct Times {
    double looked_s = 0, located_s = 0;
  };
  /// Whether one more refinement and the fix after it end within the budget.
  [[nodiscard]] bool is_affordable(int done, const Times& times) const;

  const std::vector<Eigen::Vector2d>& landmarks_m_;
  std::array<Eigen::Vector2d, 2> centres_px_;
  Settings settings_;
  const std::function<double()>& clock_s_;
  double begin_s_;
};

}  // namespace twocone::runs

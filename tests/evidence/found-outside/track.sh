# SPDX-License-Identifier: Apache-2.0
# Sourced by found-outside.sh: the filter, the track, and the map's bounds.

found A.1 "ranges to three landmarks 0.1 m apart, 5 m away, into a filter that is 0.3 m vague" \
  "the tangent at the fix's own place: chi-squared 45, and 48 % of the weak updates leave the truth outside the 99.9 % region" \
  "the fix's measurements are taken about the filter's own place; where no ellipse holds what is known then, nothing is taken" \
  "localisation/pose_filter_weak_test:PoseFilterWeak.*"
found A.8 "a weak fix in fixes.csv" \
  "the covariance holds across a direction that the table does not have" \
  "columns for the unseen direction, and for the covariances with the heading" \
  "runs/estimator_test:ToRows.OfAWeakFixTheUnseenDirectionIsThere" "runs/runs_tables_test:Tables.FixesOfAnOlderRunAreRead"
found A.11 "wheel angles from -1.5e308 to 1.5e308 and of 1e150 rad; an indefinite covariance; 10 m with a heading known to 0.5 rad" \
  "tracking with NaN; a negative variance; 71 mm stated along the way, 1.2 m true" \
  "refused with an exception and nothing changed; no_sigma; what a wrong heading shortens the way by is a state of the filter" \
  "localisation/pose_filter_extremes_test:*"
found A.12 "drive_arc with a separation of 0" "NaN" "std::invalid_argument" "localisation/odometry_test:DriveArc.NeedsASeparation"
found A.12 "an asymmetric covariance" "averaged by fix and filter, refused by triangulation" \
  "refused by all: unusable in a fix, no_sigma in the filter" \
  "localisation/pose_filter_extremes_test:PoseFilterExtremes.WhatIsNoCovarianceIsRefused"
found C.3 "two landmarks with both images mirrored: a fix 1 m outside the bounds at a sigma of 1.7 mm" \
  "ok, and the track follows it" \
  "out_of_bounds; inside the bounds two landmarks carry the track nowhere until they turn with the wheels" \
  "runs/map_bounds_test:*" "runs/estimator_stages_test:Estimator.AFixOutsideTheBoundsIsNone" \
  "runs/track_test:Track.AFixOutsideTheBoundsIsNotFollowed" "runs/runs_summary_test:Summary.WhatIsOutOfBoundsIsNoFix" \
  "localisation/pose_filter_test:PoseFilter.APairThatAgreesWithItselfAloneMovesNothing:PoseFilter.ACarriedRobot*"

step weak-fixes env TWOCONE_CASES=10000 build/release/tests/localisation/pose_filter_weak_test \
  --gtest_filter='PoseFilterWeak.RegionsHoldWhatTheySay:PoseFilterWeak.ATrackWithThemIsBetterThanWithout'
# weak_figure WORD: the number after it in the trial's line
weak_figure() { awk -v word="$1" '{ for (i = 1; i < NF; ++i) if ($i == word) { print $(i + 1); exit } }' "$work/weak-fixes.log"; }
weak_draws=$(weak_figure weak) weak_taken=$(weak_figure taken)
weak_half=$(weak_figure inside_50) weak_most=$(weak_figure inside_999)
row "weak fixes into the filter: drawn, of which taken" "${weak_draws:-0}, ${weak_taken:-0}" "10000 drawn" "$(holds "${weak_draws:-0} >= 10000")"
row "of those taken, truths in the 50 % region" "${weak_half:-0} %" "45 to 55 %" "$(holds "${weak_half:-0} >= 45 && ${weak_half:-0} <= 55")"
row "of those taken, truths in the 99.9 % region" "${weak_most:-0} %" "at least 99.5 %" "$(holds "${weak_most:-0} >= 99.5")"
row "10 s of driving, rmse without and with weak fixes" "$(weak_figure without), $(weak_figure with) mm" "less" \
  "$(holds "$(weak_figure with) + 0 < $(weak_figure without) + 0 && $(weak_figure with) + 0 > 0")"

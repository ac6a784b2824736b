# SPDX-License-Identifier: Apache-2.0
# found-outside.sh sources this file: the filter, the track, and the map's bounds.

found A.1 "ranges to three landmarks 0.1 m apart, 5 m away, into a filter with a sigma of 0.3 m" \
  "linearised at the fix's own position: chi-squared 45, and 48 % of the weak updates leave the truth outside the 99.9 % region" \
  "the fix's measurements are linearised at the filter's own position; if no ellipse describes the result, the fix is not used" \
  "localisation/localisation_test:PoseFilterWeak.*"
found A.8 "a weak fix in fixes.csv" \
  "the covariance belongs to a direction that the table does not contain" \
  "columns for the unseen direction, and for the covariances with the heading" \
  "estimation/estimation_test:ToRows.OfAWeakFixTheUnseenDirectionIsThere" "runlog/runlog_test:Tables.FixesOfAnOlderRunAreRead"
found A.11 "wheel angles from -1.5e308 to 1.5e308 and of 1e150 rad; an indefinite covariance; 10 m with a heading known to 0.5 rad" \
  "tracking with NaN; a negative variance; 71 mm stated along the way, 1.2 m true" \
  "refused with an exception and without a change; no_sigma; the shortening of the way by a wrong heading is a state of the filter" \
  "localisation/localisation_test:PoseFilterExtremes.*"
found A.12 "drive_arc with a separation of 0" "NaN" "std::invalid_argument" "localisation/localisation_test:DriveArc.NeedsASeparation"
found A.12 "an asymmetric covariance" "averaged by fix and filter, refused by triangulation" \
  "refused by all: unusable in a fix, no_sigma in the filter" \
  "localisation/localisation_test:PoseFilterExtremes.WhatIsNoCovarianceIsRefused"
found C.3 "two landmarks with both images mirrored: a fix 1 m outside the bounds at a sigma of 1.7 mm" \
  "ok, and the track follows it" \
  "out_of_bounds; inside the bounds two landmarks do not move the track until they turn with the wheels" \
  "estimation/estimation_test:MapBounds.*" "estimation/estimation_test:Estimator.AFixOutsideTheBoundsIsNone" \
  "estimation/estimation_test:Track.AFixOutsideTheBoundsIsNotFollowed" "runlog/runlog_test:Summary.WhatIsOutOfBoundsIsNoFix" \
  "localisation/localisation_test:PoseFilter.APairThatAgreesWithItselfAloneMovesNothing:PoseFilter.ACarriedRobot*"

step weak-fixes env TWOCONE_CASES=10000 build/release/tests/localisation/localisation_test \
  --gtest_filter='PoseFilterWeak.RegionsHoldWhatTheySay:PoseFilterWeak.ATrackWithThemIsBetterThanWithout'
# weak_figure WORD: prints the number after WORD in the line of the trial
weak_figure() { awk -v word="$1" '{ for (i = 1; i < NF; ++i) if ($i == word) { print $(i + 1); exit } }' "$work/weak-fixes.log"; }
weak_draws=$(weak_figure weak) weak_taken=$(weak_figure taken)
weak_half=$(weak_figure inside_50) weak_most=$(weak_figure inside_999)
row "weak fixes into the filter: drawn, and used" "${weak_draws:-0}, ${weak_taken:-0}" "10000 drawn" "$(holds "${weak_draws:-0} >= 10000")"
row "of those used, truths in the 50 % region" "${weak_half:-0} %" "45 to 55 %" "$(holds "${weak_half:-0} >= 45 && ${weak_half:-0} <= 55")"
row "of those used, truths in the 99.9 % region" "${weak_most:-0} %" "at least 99.5 %" "$(holds "${weak_most:-0} >= 99.5")"
row "10 s of driving, rmse without and with weak fixes" "$(weak_figure without), $(weak_figure with) mm" "less" \
  "$(holds "$(weak_figure with) + 0 < $(weak_figure without) + 0 && $(weak_figure with) + 0 > 0")"

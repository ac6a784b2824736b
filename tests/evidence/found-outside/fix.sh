# SPDX-License-Identifier: Apache-2.0
# found-outside.sh sources this file: ambiguous fixes, weak fixes, outliers.
fixes=localisation/localisation_test
found A.2 "one range and three bearings, two places 2.74 m apart" "ok at the wrong one, 14 mm stated" "ambiguous, both places" \
  "localisation/localisation_test:FixRivalsByName.*" "localisation/localisation_test:Mixed/FixRivals.*"
found A.6 "two circles that almost touch, with the map rotated; disjoint circles at sigma 250 to 400" "weak beside the middle, 0.07 m, or too_few" \
  "weak in the middle of the gap, for every rotation of the map" \
  "$fixes:LeastSquaresHardCases.CirclesThat*"
found A.8 "three landmarks 5 m apart from 1,044 m" "9 and 30 mm" "17 mm and 6.78 m" "$fixes:LeastSquaresHardCases.AWeakCovariance*"
found A.9 "three landmarks, two labels exchanged" "ok, the right one named as the outlier" "contradictory (within three times the sigmas: ok, widened); two against one are not decided" \
  "localisation/localisation_test:FixOutliers.Two*"
found A.10 "four far beacons with large residuals" "1.9e-5 off the minimum" "rounding: Newton's method ends it" \
  "$fixes:LeastSquaresFix.FarBeacons*"
found A.12 "bearing sigma of 10 rad" "ok" "no measurement" "$fixes:LeastSquaresFix.ABearingOfAnyDirection*"
found A.12 "range and two bearings with one solution" "too_few" "a fix" "$fixes:LeastSquaresFix.OneRangeAndTwoBearings*"
found A.12 "bearings on the landmarks' line" "contradictory, 0/0" "weak along the line" "$fixes:LeastSquaresFix.BearingsOnTheLandmarksLine*"
found A.12 "1e-12 to 1e-4 m off the danger circle" "too_few" "weak" "$fixes:LeastSquaresFix.NearTheCircle*"
found A.12 "one measurement of 1e300 among good ones" "too_few" "named as the outlier" "$fixes:LeastSquaresHardCases.OneWild*"
found A.13 "many outliers" "two are found, in 45 to 137 ms of 32; seconds of 1,000" "any number below half, with a cost linear in the landmarks" \
  "localisation/localisation_test:FixOutliers.*"

step rivals env TWOCONE_CASES=10000 build/release/tests/localisation/localisation_test --gtest_filter='Mixed/FixRivals.*'
for kind in R+3B R+B+B RR+BB RB+B+B; do
  line=$(grep "^$kind: 10000 rooms" "$work/rivals.log" || true)
  row "10,000 random rooms of $kind against a search from many starting points" "${line:-not run}" "0 hidden, 0 not global, 0 without" \
    "$([[ $line == *"ok with a rival 0, not the global minimum 0, ambiguous without a rival 0" ]] && echo yes || echo no)"
done
step outliers env TWOCONE_CASES=1000 build/release/tests/localisation/localisation_test --gtest_filter='FixOutliers.*EightOf*:FixOutliers.*ThreeHundred*'
for what in "32 measurements, 8 wrong" "1000 measurements, 300 wrong"; do
  line=$(grep "^$what" "$work/outliers.log" || true)
  share=$(sed -n 's/.*found in \([0-9]*\) of \([0-9]*\),.*/\1 \2/p' <<<"$line")
  row "outliers: the true inliers are found" "${line:-not run}" "990 of 1,000" \
    "$(holds "${share% *}+0 >= 0.99*(${share#* }+0) && ${share#* }+0 >= 1000")"
done

step fix-bench build/release/bench/localisation_bench --benchmark_min_time=0.1 --benchmark_repetitions=9 --benchmark_report_aggregates_only=true \
  --benchmark_filter='Svd|FixByLeastSquares|FixOfMixed|FixWithOutliers'
# fix_ratio A B: prints the ratio of their median processor times
fix_ratio() { awk -v a="$1_median" -v b="$2_median" '$1 == a { x = $4 } $1 == b { y = $4 } END { if (y) printf "%.1f", x / y }' "$work/fix-bench.log"; }
# ratio_row WHAT A B LIMIT: writes the row of a ratio and its limit
ratio_row() {
  local ratio
  ratio=$(fix_ratio "$2" "$3")
  row "$1" "${ratio:-not run}" "at most $4" "$(holds "${ratio:-0} > 0 && ${ratio:-0} <= $4")"
}
ratio_row "cost of a fix of six landmarks with range and bearing, over one JacobiSVD of 3 by 3" FixByLeastSquares/6 SvdOfMatrix3d 5
for kind in 1/3 2/2 3/3 1/2; do
  row "cost of ranges/bearings $kind, over a fix of six landmarks" "$(fix_ratio "FixOfMixed/$kind" FixByLeastSquares/6)" "stated" "$(passed fix-bench)"
done
for of in 32/8 1000/300; do
  ratio_row "cost with outliers $of, over the fix without" "FixWithOutliers/$of" "FixByLeastSquares/${of%/*}" 40
done

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The first day of a real robot: beliefs with uncertainties, calibration from the images alone, and robots as built. The ideal lab beside
# it, which must not lose anything.
also=(bench tests/vision/belief_statistics_test.cpp tests/evidence/robot_as_built.sh)
. "$(dirname "$0")/common.sh"

# All takes about three hours of two cores. TWOCONE_FIRST_DAY_ROBOTS=1: robots of each room that are rendered.
rendered=${TWOCONE_FIRST_DAY_ROBOTS:-10}
fixed() { LC_ALL=C printf "%.$1f" "${2:-0}"; }
last() { tail -n 1 "$work/$1.log"; }

# ---------------------------------------------------------- in the model, many robots ----
step sightings env TWOCONE_ROBOTS=1000 build/release/tests/vision/vision_test --gtest_filter='BeliefStatistics*'
while IFS=: read -r name figures; do
  target="fixes in at least 99 %, ellipses hold 93 to 97 %"
  if [[ $name == *unstated* ]]; then target="for comparison"; fi
  row "findings A.5, 1,000 robots, synthetic sightings: $name" "$figures" "$target" "$(passed sightings)"
done < <(grep ': fixes in ' "$work/sightings.log" || echo "all: not run, $(last sightings)")

# of STEP PATTERN: the first number after a text of as_built_bench
of() { sed -n "s/.*$2 \([-+.0-9]*\).*/\1/p" "$work/$1.log" | head -n 1; }
for kind in "uncalibrated 1000" "calibrated 200 --calibrate"; do
  read -r name robots flag <<<"$kind"
  step "synthetic_$name" build/release/bench/as_built_bench --robots "$robots" $flag --rows "$work/synthetic_$name.csv"
  held=$(of "synthetic_$name" 'ellipses hold')
  row "$robots robots as built, in synthetic images, $name: 95 % ellipses that hold the truth" \
    "$(tr '\n' ';' <"$work/synthetic_$name.log" | sed 's/;$//')" "92 to 98 %" "$(holds "${held:-0} >= 92 && ${held:-0} <= 98")"
done

# ------------------------------------------------- the finder, from wrong and absent rigs ----
# run_to FOLDER ARGUMENT...: a run, without what an interrupted one left there
run_to() {
  rm -rf "$1"
  "$twocone" run --out "$@"
}
ideal=()
for robot in lab hall workshop; do
  step "ideal_$robot" run_to "$work/ideal_$robot" --robot "robots/${robot}_sim.yaml" --frames 120 --seed 3
  ideal+=("$work/ideal_$robot")
done
step found build/release/bench/first_day_bench --work "$work/found" "${ideal[@]}"
row "calibrate from 40 px, 30 degrees, 20 % off, mirrored, exchanged, and an absent rig: 50 seeded cases" \
  "$(grep '^all: ' "$work/found.log" || last found)" "each found" "$(grep -q '^all: 50 of 50' "$work/found.log" && echo yes || echo no)"
row "a lens cap, a dead camera, an image of something else, a frozen camera, one camera for both" \
  "$(grep '^refusals: ' "$work/found.log" || last found)" "a clear word in each" "$(grep -q '^refusals: 5 of 5' "$work/found.log" && echo yes || echo no)"

# -------------------------------------------------------------- rendered robots ----
folders=() inside=() beyond=()
for seed in $(seq 1 "$rendered"); do
  for robot in lab hall workshop; do
    folder=$work/robots/${robot}_$seed
    step "robot_${robot}_$seed" tests/evidence/robot_as_built.sh "$twocone" "robots/${robot}_sim.yaml" "$seed" "$folder"
    [ -f "$work/robot_${robot}_$seed.status" ] || continue # not run
    folders+=("$folder")
    if ((seed % 2)); then beyond+=("$folder"); else inside+=("$folder"); fi # odd seeds have what no model has
  done
done
# figures NAME KIND FOLDER...: computes the figures of robots; of_robots NAME KEY: one of them
figures() { tests/evidence/first_day.py "$2" "${@:3}" >"$work/$1.figures" 2>&1 || true; }
of_robots() { sed -n "s/^$2 //p" "$work/$1.figures"; }
figures uncalibrated uncalibrated "${folders[@]}"
row "$(of_robots uncalibrated robots) rendered robots as built with --self-rig: frames with a fix" \
  "$(of_robots uncalibrated fixes_percent) %; $(of_robots uncalibrated true_frame_mm) mm, $(of_robots uncalibrated heading_deg) degrees" \
  "at least 80 %" "$(holds "$(of_robots uncalibrated fixes_percent) + 0 >= 80")"
for kind in "inside 3" "beyond 5"; do
  read -r name limit <<<"$kind"
  what="inside the model"
  [ "$name" = inside ] || what="with the unmodelled rest"
  if [ "$name" = inside ]; then figures inside calibrated "${inside[@]}"; else figures beyond calibrated "${beyond[@]}"; fi
  row "calibrated, $what, $(of_robots "$name" robots) robots, two fresh drives each: frames with a fix" "$(of_robots "$name" fixes_percent) % of $(of_robots "$name" frames)" \
    "at least 95 %" "$(holds "$(of_robots "$name" fixes_percent) + 0 >= 95")"
  row "the same: mean position error" \
    "$(of_robots "$name" aligned_mm) mm after alignment; in the map's true frame $(of_robots "$name" true_frame_mm) mm, of which its shift and turn are $(of_robots "$name" floor_mm) mm" \
    "at most $limit mm after alignment" "$(holds "\"$(of_robots "$name" aligned_mm)\" ~ /[0-9]/ && $(of_robots "$name" aligned_mm) + 0 <= $limit")"
  row "the same: mean heading error" "$(of_robots "$name" heading_deg) degrees" "at most 0.1 degrees" \
    "$(holds "\"$(of_robots "$name" heading_deg)\" ~ /[0-9]/ && $(of_robots "$name" heading_deg) + 0 <= 0.1")"
done
figures calibrated calibrated "${folders[@]}"
for name in uncalibrated calibrated; do
  row "rendered robots, $name: 95 % ellipses that hold the truth, mean over robots" "$(of_robots $name held_percent) +- $(of_robots $name held_error_percent) %" \
    "for information" yes
  row "rendered robots, $name: answers beyond 5 and beyond 10 sigma" \
    "$(of_robots $name beyond_5) and $(of_robots $name beyond_10) of $(of_robots $name ok)" "at most 1 in 1,000, and none" \
    "$(holds "$(of_robots $name ok) + 0 > 0 && 1000 * $(of_robots $name beyond_5) <= $(of_robots $name ok) + 0 && $(of_robots $name beyond_10) + 0 == 0")"
done
figures numbers numbers "${inside[@]}"
row "calibrated numbers of rendered robots inside the model against the truth (findings A.14)" \
  "$(of_robots numbers within) of $(of_robots numbers count) within 4 sigma; farthest: $(of_robots numbers farthest)" "all" \
  "$(holds "\"$(of_robots numbers count)\" ~ /[1-9]/ && $(of_robots numbers within) + 0 == $(of_robots numbers count) + 0")"
for folder in "${inside[@]}"; do
  name=$(basename "$folder")
  step "compared_$name" "$twocone" compare "$work/ideal_${name%_*}" "$folder/drive" --no-page --every 6 --out "$folder/compared"
done
figures causes causes "${inside[@]}"
row "compare of these robots' first drives with the ideal robot's: numbers of the causes that it names, against the truth" \
  "$(of_robots causes named) causes; lost frames, rates and stamps that are not there: $(of_robots causes invented); $(of_robots causes within) of $(of_robots causes count) numbers within 4 sigma; farthest: $(of_robots causes farthest)" \
  "all, none invented" \
  "$(holds "\"$(of_robots causes count)\" ~ /[1-9]/ && $(of_robots causes within) + 0 == $(of_robots causes count) + 0 && \"$(of_robots causes invented)\" == \"none\"")"

# ------------------------------------------------------------------- ideal lab ----
for kind in "plain 1 0.52" "smooth 3 0.16"; do
  read -r name rays limit <<<"$kind"
  step "lab_$name" run_to "$work/lab_$name" --robot robots/lab_sim.yaml --frames 450 --set "cameras.lower.antialias=$rays" --set "cameras.upper.antialias=$rays"
  mean=$(jq -r '.fix.position_error.mean_m // empty' "$work/lab_$name/summary.json" 2>/dev/null || true)
  row "ideal lab, 450 frames, $name: mean position error" "${mean:+$(fixed 3 "$(jq -n "1e3 * $mean")") mm}" "at most $limit mm" "$(holds "\"$mean\" != \"\" && 1e3 * ${mean:-1} <= $limit")"
  step "many_$name" build/release/bench/many_frames --frames 10000 --antialias "$rays" --rows "$work/many_$name.csv" --json "$work/many_$name.json" robots/lab_sim.yaml
  read -r coverage ratio mean_m <<<"$(jq -r '[.coverage, .rmse_of_bounded_m / .bound_rms_m, .mean_m] | @tsv' "$work/many_$name.json" 2>/dev/null || echo "0 0 0")"
  if [ "$(passed "many_$name")" = no ]; then
    row "ideal lab, 10,000 frames at poses anywhere, $name" "$(last "many_$name")" "ellipses hold 93 to 97 %, RMSE at most 1.3 times the bound" no
    continue
  fi
  row "ideal lab, 10,000 frames at poses anywhere, $name: 95 % ellipses that hold the truth" "$(fixed 1 "$(jq -n "100 * $coverage")") %" "93 to 97 %" "$(holds "$coverage >= 0.93 && $coverage <= 0.97")"
  row "the same: RMSE over the bound, which counts hidden landmarks as if they were seen" "$(fixed 2 "$ratio"); mean $(fixed 3 "$(jq -n "1e3 * $mean_m")") mm" "at most 1.3" "$(holds "$ratio > 0 && $ratio <= 1.3")"
done
calibrate_lab() {
  local begin=$SECONDS
  rm -f "$work/lab_plain.yaml" "$work"/lab_plain.calibration.json
  "$twocone" calibrate "$work/lab_plain" --out "$work/lab_plain.yaml" || return 1
  echo $((SECONDS - begin)) >"$work/calibrate.seconds"
}
step calibrate calibrate_lab
seconds=$(cat "$work/calibrate.seconds" 2>/dev/null || echo "")
row "calibration of 450 frames" "${seconds:+$seconds s}" "at most 60 s" "$(holds "\"$seconds\" != \"\" && ${seconds:-99} <= 60")"
step speed build/release/bench/vision_bench --benchmark_filter='^(PairToHsv|OutlineOfAPair)$' --benchmark_repetitions=5 \
  --benchmark_out="$work/speed.json" --benchmark_out_format=json
times() { jq -r --arg name "$1_median" '[.benchmarks[] | select(.name == $name) | .cpu_time][0] // empty' "$work/speed.json" 2>/dev/null || true; }
ratio=$(jq -n "$(times OutlineOfAPair) / $(times PairToHsv)" 2>/dev/null || true)
row "vision and fix of a 640x480 pair, against OpenCV's BGR to HSV of it, medians of five" "${ratio:+$(fixed 2 "$ratio") times}" "at most 3.7 times" \
  "$(holds "\"$ratio\" != \"\" && ${ratio:-99} <= 3.7")"
block "Rendered robots, calibrated" "$(cat "$work/calibrated.figures" 2>/dev/null)"
block "The last lines of the finder's cases" "$(tail -n 14 "$work/found.log")"
page "the first day of a real robot"

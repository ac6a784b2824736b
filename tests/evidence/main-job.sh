#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The main job: 450 frames in the lab for three seeds, projection against rendering, repetition, a kill, wrong input.
. "$(dirname "$0")/common.sh"

mm() { awk "BEGIN { printf \"%.1f\", 1000 * $1 }"; }

for seed in 1 2 3; do
  run=$work/seed$seed
  if [ ! -f "$work/seed$seed.status" ]; then rm -rf "$run"; fi
  step "seed$seed" "$twocone" run --robot robots/lab_sim.yaml --frames 450 --seed "$seed" --out "$run"
  if [ "$(status_of "seed$seed")" != 0 ]; then row "seed $seed: 450 frames" "$(tail -n 1 "$work/seed$seed.log")" "a run" no; continue; fi
  get() { jq -r "$1" "$run/summary.json"; }
  row "seed $seed: travelled" "$(get '.travelled_m * 100 | round / 100') m" "at least 5 m" "$(holds "$(get .travelled_m) >= 5")"
  row "seed $seed: headings covered" "$(get .headings_covered_deg) of 360 degrees" "all" "$(holds "$(get .headings_covered_deg) == 360")"
  share=$(get '.fix.frames_with_fix / .frames * 1000 | round / 10')
  row "seed $seed: frames with a fix" "$share % ($(get '.fix.verdicts | to_entries | map("\(.key) \(.value)") | join(", ")'))" "at least 95 %" "$(holds "$share >= 95")"
  mean=$(mm "$(get .fix.position_error.mean_m)")
  row "seed $seed: position error, mean (rmse, 95 %, max)" "$mean mm ($(mm "$(get .fix.position_error.rmse_m)"), $(mm "$(get .fix.position_error.p95_m)"), $(mm "$(get .fix.position_error.max_m)"))" "mean below the paper's 30 mm" "$(holds "$mean < 30")"
  read -r mean max < <(awk -F'|' '/^fix .*\|.*\|/ { print $2; exit }' "$work/seed$seed.log")
  row "seed $seed: position error of method \`paper\`, mean (max)" "${mean:-none} mm (${max:-none})" "mean 5 to 40 mm, as the paper's" "$(holds "${mean:-0} >= 5 && ${mean:-0} <= 40")"
  while read -r name range_mean range_max count; do
    row "seed $seed: range error of $name, mean (max), of $count frames" "$(mm "$range_mean") mm ($(mm "$range_max"))" "mean below 60 mm" "$(holds "$range_mean < 0.060")"
  done < <(get '.landmarks[] | "\(.name) \(.range_error.mean_m) \(.range_error.max_m) \(.range_error.count)"')
  wall=$(get '.wall_s | round')
  row "seed $seed: wall time" "$wall s; processor time: POV-Ray $(get '.render_cpu_s | round') s, twocone $(get '.own_cpu_s | round') s" "at most 360 s on two cores" "$(holds "$wall <= 360")"
done

step projection env TWOCONE_POSES=100 build/release/tests/end_to_end/end_to_end_test --gtest_filter='Robots/Projection.*'
row "projection against rendering" "$(grep 'landmark tops and' "$work/projection.log" || tail -n 1 "$work/projection.log")" "every visible top within 1 px, 100 poses" "$(passed projection)"
step round_trip build/release/tests/vision/vision_test --gtest_filter='Lens.*:MirrorView.*:MovedView.*'
row "forward then inverse projection" "$(grep -c '^\[       OK' "$work/round_trip.log") tests, 40000 seeded points and pixels" "1e-12 relative" "$(passed round_trip)"
step repeat env TWOCONE_FRAMES=450 TWOCONE_ROBOT=robots/lab_sim.yaml build/release/tests/end_to_end/end_to_end_test --gtest_filter='RunInTheLab.TheSameSeed*'
row "same seed twice, 450 frames" "$(grep -E '^\[  (PASSED|FAILED)' "$work/repeat.log" | head -n 1)" "tables byte-equal, 900 images pixel-equal" "$(passed repeat)"
step kill tests/end_to_end/kill.sh "$twocone" "$PWD" robots/lab_sim.yaml 450
row "killed after half of the frames (kill -9)" "$(grep '^killed' "$work/kill.log" || tail -n 1 "$work/kill.log")" "the written part is read and reported; no POV-Ray process remains" "$(passed kill)"
step wrong_input tests/end_to_end/wrong_input.sh "$twocone" "$PWD"
row "wrong input" "$(grep -c ' exit [12] ' "$work/wrong_input.log") cases, listed below" "one clear line, exit 1 or 2" "$(passed wrong_input)"

block "Run of seed 1" "$(cat "$work/seed1.log")"
block "Wrong input" "$(cat "$work/wrong_input.log")"
page "the main job"

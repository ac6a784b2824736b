# SPDX-License-Identifier: Apache-2.0
# ../found-outside.sh sources this file: in rooms that agree with the robot's map and rig, the corrections must not lose accuracy.

# room NAME FRAMES FIXES RMSE_MM: the last two are results of the same command with commit 48dd7f07a7, before the corrections
room() {
  local name=$1 frames=$2 before=$3 before_mm=$4 after after_mm
  step "room_$name" "$twocone" run --robot "robots/${name}_sim.yaml" --behaviour wander --frames "$frames" --seed 1 --force --out "$work/room_$name"
  if [ "$(passed "room_$name")" = no ]; then
    row "$name, $frames frames: fixes and their rmse, before and after" "not run" "at most 1 % of the frames fewer; within the interval" no
    return
  fi
  after=$(jq '.fix.frames_with_fix' "$work/room_$name/summary.json")
  after_mm=$(jq '.fix.position_error.rmse_m * 1000' "$work/room_$name/summary.json")
  row "$name, $frames frames: fixes, before and after" "$before, $after" "at most 1 % of the frames fewer" "$(holds "$after >= $before - 0.01 * $frames")"
  row "$name: rmse of the fixes, before and after" "$before_mm, $(printf '%.3f' "$after_mm") mm" "within the 95 % interval of the former, 1.96 rmse / sqrt(2 n)" \
    "$(holds "$after_mm <= $before_mm * (1 + 1.96 / sqrt(2 * $before))")"
}
room lab 450 449 0.837
room hall 150 150 0.386
room workshop 450 442 0.434

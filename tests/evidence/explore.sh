#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Drives of `--behaviour explore` among furniture and a moving crate that the map does not list (explore.py), judged by the truth:
# one minute each, 5 frames per second, 0.3 m/s. TWOCONE_EXPLORE_DRIVES=N: only the first N of 100.
also=(tests/evidence/explore.sh tests/evidence/explore.py)
. "$(dirname "$0")/common.sh"
export OMP_NUM_THREADS=1
drives=${TWOCONE_EXPLORE_DRIVES:-100}

# drive NAME SEED [plain]
drive() {
  local folder=$work/$1
  rm -rf "$folder"
  python3 tests/evidence/explore.py make "$folder" "${@:2}"
  "$twocone" run --robot "$folder/robot.yaml" --behaviour explore --frames 300 --seed "$2" --out "$folder/run" \
    --set cameras.lower.rate_hz=5 --set cameras.upper.rate_hz=5 --set latency_frames=1 --set drive.max_speed_mps=0.43
  python3 tests/evidence/explore.py judge "$folder" "$folder/run" | sed 's/^/judged /'
  rm -r "$folder/run/lower" "$folder/run/upper" # as much as ten gigabytes in all
}
export -f drive
export work twocone

# Two at a time: a drive uses one core.
for ((seed = 1; seed <= drives; seed += 2)); do
  step "textured_$seed" bash -c 'drive textured_$0 $0' "$seed" &
  step "textured_$((seed + 1))" bash -c 'drive textured_$0 $0' "$((seed + 1))" &
  wait
done
for seed in 1 2 3; do step "plain_$seed" bash -c 'drive plain_$0 $0 plain' "$seed"; done
step refused bash -c '! "$0" run --robot robots/lab_sim.yaml --behaviour explore --frames 5 --out "$1" 2>&1' "$twocone" "$work/refused"
step blind bash -c '"$0" doctor --robot robots/scout_sim.yaml --seconds 0.5 --images "$1" 2>&1 </dev/null | grep "blind"' "$twocone" "$work/doctor"

# summary PREFIX: a row for each figure of the judged drives
summary() {
  cat "$work/$1"_*.log | sed -n 's/^judged //p' | python3 -c '
import json, statistics, sys
drives = [json.loads(line) for line in sys.stdin]
def row(what, figure, target, met): print(f"row | {what} | {figure} | {target} | {met} |")
if drives:
    name, n = sys.argv[1], len(drives)
    visited = [d["visited"] for d in drives]
    into = lambda what: sum(what in d["drove_into"] for d in drives)
    met = lambda good: "yes" if good else "no"
    row(f"{name}: drives of a minute", n, "100" if name == "textured" else "-", met(n >= 100 or name != "textured"))
    row(f"{name}: drives that touched furniture", into("furniture"), "0", met(into("furniture") == 0))
    row(f"{name}: drives that drove into the crate", into("crate"), "0", met(into("crate") == 0))
    row(f"{name}: drives in which the crate ran into the robot", sum("crate" in d["was_run_into"] for d in drives), "-", "yes")
    row(f"{name}: least distance to furniture, median", f"{statistics.median(d['"'least_m'"'] for d in drives):.3f} m", "-", "yes")
    target = "60 %" if name == "textured" else "-"
    share = statistics.mean(visited)
    row(f"{name}: floor visited (within 0.4 m of the way), mean of the reachable", f"{100 * share:.0f} % ({100 * min(visited):.0f} to {100 * max(visited):.0f})", target, met(share >= 0.6 or name != "textured"))
    row(f"{name}: way, mean", f"{statistics.mean(d['"'way_m'"'] for d in drives):.1f} m", "-", "yes")
' "$1" >"$work/summary_$1.log"
  rows "summary_$1"
}
# The floor plan alone, without landmarks: a drive among the furniture that the map lists.
step plan_run "$twocone" run --robot robots/scout_sim.yaml --behaviour waypoints --frames 300 --out "$work/plan_run"
step plan "$twocone" scan "$work/plan_run" --plan
placed=$(log plan | { grep "placed by the floor plan" || true; } | tail -n 1)
figure() { sed -n "$1" <<<"$placed"; }
position=$(figure 's/.*errors \([0-9.]*\) mm.*/\1/p')
heading=$(figure 's/.* and \([0-9.]*\) degrees.*/\1/p')
held=$(figure 's/.*hold \([0-9]*\) % of positions.*/\1/p')
heading_held=$(figure 's/.* and \([0-9]*\) % of headings.*/\1/p')
# The same as the only source of the track: the study without landmarks on its map. Errors and coverage of all frames together.
without_landmarks() {
  local seed behaviour
  rm -rf "$work/track"
  mkdir -p "$work/track"
  cp -r scenes "$work/track/scenes"
  sed 's/^landmarks:/landmarks: []/; /name: .*colour/d' scenes/study.map.yaml >"$work/track/scenes/study.map.yaml"
  sed 's#^map: .*#map: scenes/study.map.yaml#' robots/scout_sim.yaml >"$work/track/robot.yaml"
  for seed in 1 2 3 7; do
    behaviour=wander
    ((seed > 2)) || behaviour=waypoints
    "$twocone" run --robot "$work/track/robot.yaml" --set estimator.plan=true --behaviour $behaviour --frames 300 --seed $seed --out "$work/track/$seed" || return 1
    rm -r "$work/track/$seed/lower" "$work/track/$seed/upper"
  done
  python3 tests/evidence/explore.py track "$work"/track/[0-9]
}
step without_landmarks without_landmarks
rows without_landmarks
row "floor plan, no landmarks: frames placed" "$(figure 's/ placed.*//p')" "300 of 300" "$(holds "\"$(figure 's/ placed.*//p')\" == \"300 of 300 frames\"")"
row "floor plan: mean error of the position" "${position:-none} mm" "20 mm" "$(holds "${position:-99} <= 20")"
row "floor plan: mean error of the heading" "${heading:-none} degrees" "0.3" "$(holds "${heading:-9} <= 0.3")"
row "floor plan: 95 % ellipses hold the position" "${held:-none} %" "92 to 98 %" "$(holds "${held:-0} >= 92 && ${held:-0} <= 98")"
row "floor plan: 1.96 sigma hold the heading" "${heading_held:-none} %" "92 to 98 %" "$(holds "${heading_held:-0} >= 92 && ${heading_held:-0} <= 98")"
summary textured
summary plain
row "a pair that sees no floor is refused, and design is named" "$(log refused | tail -n 1)" "refused" "$(log refused | grep -q 'twocone design' && passed refused || echo no)"
row "the blind zone, by doctor" "$(log blind | tail -n 1)" "named" "$(log blind | grep -q 'blind' && echo yes || echo no)"
page "exploring by what is seen"

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The native renderer against POV-Ray: pixels at random poses, processor time, and what falls back. Robots in scenes of other authors.
. "$(dirname "$0")/common.sh"

bench=build/release/bench/native_bench
poses=${TWOCONE_RENDERER_POSES:-100}

# of STEP KEY: a figure of native_bench
of() { jq -r ".[0].$2 // empty" "$work/$1.json" 2>/dev/null || true; } # nothing if it was not run
fixed() { LC_ALL=C printf "%.$1f" "${2:-0}"; }
percent() { if [ -n "$1" ]; then fixed 4 "$(jq -n "100 * $1")"; else echo "not run,"; fi; }

for robot in {lab,hall,workshop,create2,pi_csi,usb_camera}_sim pair/{one,two} mirrors/{cone120,hyperboloid,three_cameras} effects/{plain,shadows,noisy}; do
  name=plain_${robot//\//_}
  step "$name" "$bench" --poses "$poses" --frames 8 --json "$work/$name.json" "robots/$robot.yaml"
  off=$(of "$name" different_worst)
  row "$robot, 640x480 plain: mirror pixels off by more than one level, in $(of "$name" images) images at random poses" \
    "mean $(percent "$(of "$name" different_mean)") %, worst $(percent "$off") %" "at most 0.1 %" "$(holds "${off:-1} <= 0.001")"
done
for target in lab:15 hall:12 workshop:12; do
  name=plain_${target%:*}_sim
  ratio=$(of "$name" ratio)
  row "${target%:*}, 640x480 plain: processor time of a stereo frame against POV-Ray's with the program's own pool, medians of five" \
    "$(fixed 1 "$ratio") times less: $(fixed 1 "$(of "$name" native_ms)") ms, POV-Ray $(fixed 0 "$(of "$name" povray_ms)") ms" \
    "at least ${target#*:} times" "$(holds "${ratio:-0} >= ${target#*:}")"
done

for robot in lab hall workshop; do
  name=smoothed_$robot
  step "$name" "$bench" --antialias 3 --poses $((poses / 5)) --frames 2 --json "$work/$name.json" "robots/${robot}_sim.yaml"
  off=$(of "$name" different_worst)
  row "$robot, 640x480, 3x3 rays: mirror pixels off by more than one level" \
    "worst of $(of "$name" images) images $(percent "$off") %; $(fixed 1 "$(of "$name" ratio)") times less processor time" "at most 0.5 %" "$(holds "${off:-1} <= 0.005")"
done

for scene in effects/area_light effects/radiosity effects/glass examples/chess examples/patio examples/wineglass; do
  name=${scene#*/}
  step "falls_back_$name" "$bench" --poses 1 --frames 1 --repeats 1 "robots/$scene.yaml"
  why=$(sed -n 's/^robots.*POV-Ray: //p' "$work/falls_back_$name.log")
  row "$scene is rendered by POV-Ray" "${why:-it is not}" "a construct that the tracer does not know" "$([ -n "$why" ] && echo yes || echo no)"
done

for renderer in auto povray; do
  if [ ! -f "$work/run_$renderer.status" ]; then rm -rf "$work/run_$renderer"; fi
  step "run_$renderer" "$twocone" run --robot robots/lab_sim.yaml --frames 450 --renderer "$renderer" --out "$work/run_$renderer"
done
wall() { jq -r .wall_s "$work/run_$1/summary.json" 2>/dev/null || echo 0; } # 0 if it was not run
ratio=$(jq -n "$(wall povray) / $(wall auto)" 2>/dev/null || echo 0)
row "the demo's run of 450 frames, against --renderer povray" "$(fixed 1 "$ratio") times shorter: $(fixed 0 "$(wall auto)") s, $(fixed 0 "$(wall povray)") s" "at least 4 times" "$(holds "$ratio >= 4")"

# compared FILE KEYS COLUMN_A COLUMN_B: prints the number of rows that both runs have, the mean distance of the two points, and the greatest
compared() {
  python3 - "$work/run_auto/$1" "$work/run_povray/$1" "$2" "$3" "$4" <<'PYTHON' 2>/dev/null || echo "0 0 0" # not run
import csv, math, sys
files, keys, columns = sys.argv[1:3], sys.argv[3].split(","), sys.argv[4:6]
a, b = ({tuple(r[k] for k in keys): [float(r[c]) for c in columns] for r in csv.DictReader(open(f)) if r[columns[0]]} for f in files)
d = [math.dist(a[k], b[k]) for k in a if k in b]
print(len(d), sum(d) / len(d), max(d))
PYTHON
}
read -r fixes mean_m worst_m <<<"$(compared fixes.csv frame x_m y_m)"
row "the same run: distance of the fixes of both renderers" \
  "mean $(fixed 4 "$(jq -n "1e3 * $mean_m")") mm, greatest $(fixed 4 "$(jq -n "1e3 * $worst_m")") mm, of $fixes fixes" "mean at most 0.05 mm" "$(holds "$fixes > 0 && $mean_m <= 5e-5")"
read -r seen mean_px worst_px <<<"$(compared sightings.csv frame,landmark,view column_px row_px)"
row "the same run: distance of the landmarks' fitted tops in the images of both renderers" \
  "mean $(fixed 4 "$mean_px") px, greatest $(fixed 4 "$worst_px") px, of $seen sightings" "at most 0.05 px" "$(holds "$seen > 0 && $worst_px <= 0.05")"

# The answer to an image steers the robot before the next image.
sed "s/^latency_frames: .*/latency_frames: 0/; s|\.\./|$PWD/|" robots/lab_sim.yaml >"$work/latency_0.yaml"
if [ ! -f "$work/real_time.status" ]; then rm -rf "$work/run_real_time"; fi
step real_time "$twocone" run --robot "$work/latency_0.yaml" --frames 450 --real-time --out "$work/run_real_time"
paced=$(sed -n 's/^ *- .*\(real time, a frame.*\)/\1/p' "$work/run_real_time/run.yaml" 2>/dev/null | tr -d '"' || true)
late=$(sed -n 's/.*: \([0-9]*\) of [0-9]* late.*only sleeps.*/\1/p' <<<"$paced")
row "the lab at 640x480 and 15 Hz in real time, latency_frames: 0, with vision, fix and storing" "${paced:-not run}" "at most 1 % late, with a bare sleeper's lateness beside it" "$(holds "${late:-450} <= 4")"

step growth build/release/bench/growth_bench --parts pixels,objects
row "growth by pixels and objects, with exponents; threads are in the table of plain images" "$(grep -c exponent "$work/growth.log" 2>/dev/null || true) tables" "10 to 10,000 objects" "$(passed growth)"

. tests/evidence/new_scenes.sh

step asan_build bash -c 'cmake --preset asan -D TWOCONE_BUILD_FUZZERS=ON && cmake --build --preset asan --target scene_fuzz'
step fuzz build/asan/tests/fuzz/scene_fuzz 500000 7 scenes/lab.pov scenes/hall.pov tests/fuzz/keywords.pov tests/sim_povray/scenes/tiny.pov
row "mutated scenes, read, evaluated and traced; AddressSanitizer and UndefinedBehaviorSanitizer" "$(tail -n 1 "$work/fuzz.log")" "half a million, no crash" "$(passed fuzz)"

block "Plain, and the wall time of a stereo frame by threads" "$(tail -qn 2 "$work"/plain_*.log)"
block "Growth" "$(cat "$work/growth.log" 2>/dev/null || echo "not run")"
block "Smoothed" "$(tail -qn 2 "$work"/smoothed_*.log)"
page "the native renderer"
